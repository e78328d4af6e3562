//! Meshes of which single precision keeps too little.

use super::{Scene, boxes::Box3};

/// Steps of single precision that are a larger part of a mesh's size are seen in its shape.
const COARSE: f64 = 1.0e-3;

impl Scene {
    /// Warns of meshes of which single precision has lost too much: by the vertices that they have, or by where these are in the scene.
    pub(super) fn warn_of_coarse_vertices(&mut self) {
        let name = |mesh: usize| self.meshes[mesh].name.as_str();
        let own = self.meshes.iter().map(|mesh| (mesh.name.as_str(), coarseness(&mesh.box_of_vertices())));
        let placed = self.instances.iter().zip(self.placed_boxes());
        let placed = placed.map(|(instance, of)| (name(instance.mesh), coarseness(&of)));
        let own = coarsest(
            own,
            "their mesh",
            "move the vertices to the origin of the mesh, and their node to where they were",
        );
        let placed = coarsest(placed, "the scene", "leave out what makes the scene so wide, or bring it nearer");
        self.warnings.extend(own.into_iter().chain(placed));
    }
}

/// How coarse the steps of single precision are for some points.
struct Coarseness {
    /// The largest coordinate.
    far: f64,
    /// The step there.
    step: f64,
    /// The largest side of the bounds.
    size: f64,
}

fn coarseness(&Box3 { lo, hi }: &Box3) -> Coarseness {
    let far = lo.abs().max(hi.abs()).max_element();
    let step = f64::from((far as f32).next_up()) - f64::from(far as f32);
    Coarseness { far, step, size: (hi - lo).max_element() }
}

/// A sentence about the mesh that suffers most, if one does.
fn coarsest<'a>(meshes: impl Iterator<Item = (&'a str, Coarseness)>, whose: &str, remedy: &str) -> Option<String> {
    let mut coarse: Vec<_> = meshes.filter(|(_, c)| c.size > 0.0 && c.step > COARSE * c.size).collect();
    let share = |(_, c): &(&str, Coarseness)| c.step / c.size;
    coarse.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let (name, Coarseness { far, step, size }) = coarse.first()?;
    let others = if coarse.len() > 1 { format!(" (and {} more)", coarse.len() - 1) } else { String::new() };
    Some(format!(
        "mesh {name}{others}: it has a size of {size:.4}, and vertices {far:.4e} from the origin of {whose}, where single precision has \
         steps of {step:.2e}; {remedy}"
    ))
}
