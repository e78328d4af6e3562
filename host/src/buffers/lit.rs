//! Which bodies have lights inside, and through whose borders lights outside are sampled.

use super::lights::emits;
use crate::bvh::Bounds;
use crate::scene::{AlphaMode, Instance, LightKind, Scene, Volume};

/// Of each material, whether light may shine inside of a body of it that scatters: a light is within the bounds of one of its instances. Which
/// light it is does not matter, for others are found to be hidden.
pub(super) fn materials(scene: &Scene) -> Vec<bool> {
    let mut lit = vec![false; scene.materials.len()];
    let material = |instance: &Instance| scene.meshes[instance.mesh].material;
    let bodies =
        scene.instances.iter().filter(|body| scene.materials[material(body)].volume.is_some_and(|v| v.scatters()));
    let bodies: Vec<(usize, Bounds)> =
        bodies.map(|body| (material(body), triangles(scene, body).fold(Bounds::EMPTY, Bounds::union))).collect();
    if bodies.is_empty() {
        return lit;
    }
    let mut light = |place: Bounds| {
        for (material, _) in bodies.iter().filter(|(_, body)| overlap(body, &place)) {
            lit[*material] = true;
        }
    };
    for source in &scene.lights {
        if let LightKind::Point { position } | LightKind::Spot { position, .. } = source.kind {
            light(Bounds::of(&[position.as_vec3(); 3]));
        }
    }
    for emitter in scene.instances.iter().filter(|instance| emits(&scene.materials[material(instance)])) {
        triangles(scene, emitter).for_each(&mut light);
    }
    lit
}

/// Whether light from inside of bodies of the material passes their surface straight and undimmed: a white dielectric of the index 1 that
/// transmits all light and has no texture and no shading normals, which lose what they send to the wrong side. Nothing but air is `around` it.
pub(super) fn is_clear(scene: &Scene, index: usize, around: &[u32]) -> bool {
    let m = &scene.materials[index];
    let passes = (m.ior, m.transmission, m.metallic, m.base_color) == (1.0, 1.0, 0.0, [1.0; 3]);
    let plain = around[index] == 0 && m.alpha_mode == AlphaMode::Opaque && m.emission == [0.0; 3] && !m.is_textured();
    let medium = m.volume.filter(Volume::scatters).and_then(|volume| volume.scattering);
    let faceted = || scene.meshes.iter().all(|mesh| mesh.material != index || mesh.normals.is_empty());
    passes && plain && medium.is_some_and(|medium| medium.denser_outside == 1.0) && faceted()
}

/// The bounds of an instance's triangles in the world.
fn triangles<'a>(scene: &'a Scene, instance: &'a Instance) -> impl Iterator<Item = Bounds> + 'a {
    let placed = |corner| instance.transform.transform_point3(corner).as_vec3();
    scene.meshes[instance.mesh].triangles().map(move |corners| Bounds::of(&corners.map(placed)))
}

fn overlap(a: &Bounds, b: &Bounds) -> bool {
    a.lo.cmple(b.hi).all() && b.lo.cmple(a.hi).all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn bodies_with_lights_inside_are_found() {
        let of = |name: &str| {
            let scene = builtin::scene(name).expect("built in");
            let lit = materials(&scene).into_iter().zip(&scene.materials).filter(|(lit, _)| *lit);
            lit.map(|(_, material)| material.name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(of("candles"), ["wax", "red wax", "stearin"]);
        assert!(of("cube").is_empty() && of("slab").is_empty() && of("cornell").is_empty());
    }
}
