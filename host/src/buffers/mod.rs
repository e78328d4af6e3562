//! The scene as kernels see it: flattened triangles under a BVH, materials, lights, textures and environment, in arenas.
//!
//! ```
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::Vec3;
//! use restir_shared::scene::Trace;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! assert_eq!(u64::from(scene.header.triangle_count), scene.stats().triangles);
//!
//! // a ray along the view of the camera has the same hit in the arena's tree as in the wider one for the CPU
//! let camera = scene.camera.params(1, 1);
//! let direction = Vec3::from_array(camera.forward).normalize();
//! let ray = Ray { origin: Vec3::from_array(camera.position), direction, t_max: Ray::FAR, key: 0 };
//! let hit = scene.view().closest(&ray);
//! assert!(hit.is_hit());
//! assert_eq!(hit, scene.traced_view().closest(&ray));
//! # Ok::<(), Error>(())
//! ```

mod arena;
mod check;
mod coincident;
mod color;
mod environment;
mod features;
mod geometry;
mod lights;
mod lit;
mod moving;
mod shading;
mod texels;
mod triangles;

use crate::bvh::{self, Bounds, Bvh, Effort};
use crate::scene::{Camera, Scene};
use crate::{Error, memory, wide_bvh::WideBvh};
use glam::{DVec3, UVec4, Vec3};
use restir_shared::layout::{
    LIGHT_TRIANGLE, NODE_WORDS, NONE, SHADING_WORDS, SceneHeader, TRIANGLE_ALPHA, TRIANGLE_WORDS,
};
use restir_shared::scene::SceneView;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use arena::Attributes;
use environment::EnvironmentMap;
use geometry::Geometry;
use lights::LightTables;
use moving::{Moving, Posed};
use texels::Texels;
use triangles::Triangle;

/// A scene in its arenas.
#[derive(Clone, Debug)]
pub struct SceneBuffers {
    /// Where the tables are.
    pub header: SceneHeader,
    /// Geometry arena, 4 words of 32 bits to each of the layout's.
    pub geometry: Arc<[u32]>,
    /// Attribute arena.
    pub attributes: Arc<[u32]>,
    /// Texel arena; one word of zeros for a scene without textures and environment.
    pub texels: Arc<[u32]>,
    /// The scene's feature bits: what kernels may be specialised to.
    pub features: u32,
    /// The camera.
    pub camera: Camera,
    origin: DVec3,
    stats: SceneStats,
    /// of all copies
    wide: Arc<OnceLock<WideBvh>>,
    /// where its objects are
    posed: Arc<Posed>,
    moving: Option<Arc<Moving>>,
}

/// A scene's triangles under their tree, and its images.
#[derive(Debug)]
struct Flat {
    /// In the order of the arena.
    triangles: Vec<Triangle>,
    bvh: Bvh,
    /// How many were left out for want of area.
    skipped: u64,
    /// Where they are; the words lie in the arena.
    texels: Texels,
    environment: Option<EnvironmentMap>,
    /// Of each material, whether a triangle has it.
    used_materials: Vec<bool>,
    /// Whether there are shading records.
    with_shading: bool,
    /// Whether there are second sets of texture coordinates.
    with_second_uvs: bool,
}

/// What a scene consists of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneStats {
    /// Triangles that can be hit.
    pub triangles: u64,
    /// Triangles that were skipped because they have no area.
    pub skipped_triangles: u64,
    /// Inner nodes of the BVH.
    pub nodes: u64,
    /// Most nodes that a traversal can have pending.
    pub bvh_depth: u32,
    /// Emissive triangles.
    pub emissive_triangles: u64,
    /// Textures in use.
    pub textures: u64,
    /// The number of materials.
    pub materials: u64,
    /// Size of the arenas.
    pub bytes: u64,
    /// Lower and upper corner of the bounds, relative to [`Scene::origin`].
    pub bounds: [[f32; 3]; 2],
    /// Names of the feature bits that are set.
    pub features: Vec<&'static str>,
    /// Meshes with triangles that emit and lay in other surfaces, and the meshes of those, by their names. The triangles are moved by some 10^-5 of
    /// their largest coordinate, so that all rays see the same of them: in front of what does not emit, and of lamps that come later in the scene.
    pub coincident_lamps: Vec<[String; 2]>,
}

impl SceneStats {
    /// What a user should know about it, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let names = |[lamp, other]: &[String; 2]| format!("{lamp:?} in {other:?}");
        let mut named: Vec<String> = self.coincident_lamps.iter().map(names).collect();
        let (all, named_at_most) = (named.len(), 3);
        if all == 0 {
            return Vec::new();
        }
        named.truncate(named_at_most);
        let more = if all > named_at_most { format!(" and {} more", all - named_at_most) } else { String::new() };
        vec![format!(
            "lamps lie in other surfaces ({}{more}): their triangles are moved until rays can tell them apart, in front of what does not emit and of \
             lamps that come later in the file; leave a gap, or leave one of them out",
            named.join(", ")
        )]
    }
}

impl SceneBuffers {
    /// Flattens a scene and builds its BVH. Of a scene with an animation it is the moment 0.
    ///
    /// # Errors
    /// [`Error::Scene`] for what is not finite or too far away, an index or a parameter out of range, or a scene without
    /// any triangle of positive area; [`Error::Memory`] for one too large to hold.
    pub fn build(scene: &Scene) -> Result<Self, Error> {
        Self::built(scene, !scene.animation.is_still())
    }

    /// As [`Self::build`], of a scene that will be edited: it can be [refitted](Self::refit), and sessions keep their history. A
    /// triangle without an area stays, for it may get one.
    ///
    /// # Errors
    /// As of [`Self::build`].
    pub fn build_editable(scene: &Scene) -> Result<Self, Error> {
        Self::built(scene, true)
    }

    fn built(scene: &Scene, moves: bool) -> Result<Self, Error> {
        check::check(scene)?;
        let (buffers, flat) = Self::flattened(&scene.at(0.0), moves)?;
        Ok(if moves { buffers.with_motion(Arc::new(Moving::new(scene, flat))) } else { buffers })
    }

    fn flattened(scene: &Scene, moves: bool) -> Result<(Self, Flat), Error> {
        let (triangles, boxes, skipped) = triangles::flatten(scene, moves)?;
        let bvh = bvh::build(&boxes, Effort::QUICK);
        drop(boxes);
        let triangles: Vec<Triangle> = bvh.order.iter().map(|&i| triangles[i as usize]).collect();
        let environment = scene.environment.as_ref().and_then(EnvironmentMap::new);
        check_texels(scene)?;
        let used_materials = used_materials(scene, &triangles);
        let with_shading = shading::needs_shading(scene);
        let with_second_uvs =
            scene.materials.iter().zip(&used_materials).any(|(m, used)| *used && m.needs_second_uvs());
        let mut texels = Texels::new(scene, &used_materials, environment.as_ref());
        let mut words = std::mem::take(&mut texels.words);
        words.resize(words.len().max(4), 0);
        let flat = Flat { triangles, bvh, skipped, texels, environment, used_materials, with_shading, with_second_uvs };
        Ok((Self::assemble(scene, &flat, Geometry::New, words.into())?, flat))
    }

    /// The arenas and all about them.
    fn assemble(scene: &Scene, flat: &Flat, geometry: Geometry<'_>, texel_words: Arc<[u32]>) -> Result<Self, Error> {
        let Flat { triangles, bvh, skipped, texels, .. } = flat;
        let environment = flat.environment.as_ref();
        let (scene, around) = &surrounded(scene, triangles);
        let (mut geometry, bounds, coincident) = geometry::packed(scene, flat, geometry);
        let camera = scene.camera.unwrap_or_else(|| Camera::framing(corners(&bounds), 1.0));
        check::check_camera(scene, &camera)?;
        let tables = LightTables::new(scene, triangles, environment, &bounds);
        let attributes = Attributes::new(scene, &tables, texels, environment, around);
        geometry::mark(&mut geometry, scene, flat, &tables);
        let features = features::of_scene(scene, flat, &tables, around);

        let triangle_base = bvh.nodes.len() as u32 * NODE_WORDS;
        let triangle_count = triangles.len() as u32;
        let header = SceneHeader {
            bounds_lo: bounds.lo.to_array(),
            triangle_base,
            bounds_hi: bounds.hi.to_array(),
            triangle_count,
            light_count: tables.lights.len() as u32,
            root: bvh.root,
            shading_base: if flat.with_shading { triangle_base + triangle_count * TRIANGLE_WORDS } else { NONE },
            second_uv_base: if flat.with_second_uvs {
                triangle_base + triangle_count * (TRIANGLE_WORDS + SHADING_WORDS)
            } else {
                NONE
            },
            srgb_base: texels.srgb_base,
            counterpart_base: NONE,
            ..attributes.header
        };
        let words = geometry.len() + attributes.words.len() + texel_words.len();
        let stats = SceneStats {
            triangles: u64::from(triangle_count),
            skipped_triangles: *skipped,
            nodes: bvh.nodes.len() as u64,
            bvh_depth: bvh.depth() as u32,
            emissive_triangles: tables.count(LIGHT_TRIANGLE) as u64,
            textures: texels.count() as u64,
            materials: scene.materials.len() as u64,
            bytes: words as u64 * 4,
            bounds: corners(&bounds),
            features: features::names(features),
            coincident_lamps: coincident.names(scene),
        };
        Ok(Self {
            header,
            geometry,
            attributes: attributes.words.into(),
            texels: texel_words,
            features,
            camera,
            origin: scene.origin,
            stats,
            wide: Arc::default(),
            posed: Posed::new(scene, coincident.moved),
            moving: None,
        })
    }

    /// What stands for a scene of other types: no triangle, and the features that its surfaces and lights may have.
    pub(crate) fn foreign(features: u32) -> Self {
        let nothing: Arc<[u32]> = Arc::new([0; 4]);
        Self {
            header: SceneHeader::default(),
            geometry: nothing.clone(),
            attributes: nothing.clone(),
            texels: nothing,
            features,
            camera: Camera::framing([[-1.0; 3], [1.0; 3]], 1.0),
            origin: DVec3::ZERO,
            stats: SceneStats::default(),
            wide: Arc::default(),
            posed: Arc::default(),
            moving: None,
        }
    }

    /// Whether it stands for a scene of other types: all others have a triangle.
    pub(crate) fn is_foreign(&self) -> bool {
        self.header.triangle_count == 0
    }

    /// Where in the world the origin of all coordinates here is: [`Scene::origin`].
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// What the scene consists of.
    pub fn stats(&self) -> SceneStats {
        self.stats.clone()
    }

    /// The scene as the kernels' functions take it.
    pub fn view(&self) -> SceneView<'_> {
        SceneView {
            header: self.header,
            geometry: bytemuck::cast_slice::<u32, UVec4>(&self.geometry),
            attributes: bytemuck::cast_slice::<u32, UVec4>(&self.attributes),
            texels: bytemuck::cast_slice::<u32, UVec4>(&self.texels),
            features: self.features,
            tracer: None,
        }
    }

    /// The corners of all triangles, in the order of the numbers that hits have: for who traces rays in a tree of his own.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [Vec3; 3]> + '_ {
        let view = self.view();
        (0..view.header.triangle_count).map(move |triangle| {
            let at = (view.header.triangle_base + triangle * TRIANGLE_WORDS) as usize;
            [0, 1, 2].map(|corner| {
                let [x, y, z, _] = view.geometry[at + corner].to_array().map(f32::from_bits);
                Vec3::new(x, y, z)
            })
        })
    }

    /// A tree for the CPU, which finds the hits of [`Self::view`] two to three times as fast. It is built on the first
    /// call: of a scene that stands still with more effort than of one that has another tree at each moment.
    #[doc(hidden)]
    pub fn tracer(&self) -> &WideBvh {
        let build = if self.is_animated() { WideBvh::new } else { WideBvh::thorough };
        self.wide.get_or_init(|| build(&self.view()))
    }

    /// [`Self::view`] with rays traced by [`Self::tracer`].
    pub fn traced_view(&self) -> SceneView<'_> {
        SceneView { tracer: Some(self.tracer()), ..self.view() }
    }
}

/// Material and instance of a triangle, by their indices in the scene.
pub(crate) fn owner(view: &SceneView<'_>, triangle: u32) -> (u32, u32) {
    let at = (view.header.triangle_base + triangle * TRIANGLE_WORDS) as usize;
    let word = |i: usize| view.geometry.get(at + i).map_or(0, |word| word.w);
    (word(0), word(2) & !TRIANGLE_ALPHA)
}

/// The scene has its textures, the arena is made of them, and then shared: for a moment all three are there.
fn check_texels(scene: &Scene) -> Result<(), Error> {
    let bytes: u64 = scene.textures.iter().map(|texture| texture.texels.bytes()).sum();
    memory::check(3 * bytes, &format!("the textures of scene {}", scene.name), "use smaller ones")
}

fn corners(bounds: &Bounds) -> [[f32; 3]; 2] {
    [bounds.lo.to_array(), bounds.hi.to_array()]
}

fn scene_error(scene: &Scene, problem: String) -> Error {
    Error::Scene { scene: scene.name.clone(), problem }
}

/// The scene with indices of refraction that are relative to what is around, and by material one more than the index of a triangle of that;
/// 0 for air.
fn surrounded<'a>(scene: &'a Scene, triangles: &[Triangle]) -> (Cow<'a, Scene>, Vec<u32>) {
    let surroundings = scene.surroundings();
    if surroundings.iter().all(Option::is_none) {
        return (Cow::Borrowed(scene), vec![0; surroundings.len()]);
    }
    let first = |instance: usize| triangles.iter().position(|triangle| triangle.object as usize == instance);
    let word = |around: &Option<usize>| around.and_then(first).map_or(0, |triangle| triangle as u32 + 1);
    (Cow::Owned(scene.relative_to(&surroundings)), surroundings.iter().map(word).collect())
}

/// Of each material, whether a triangle has it.
fn used_materials(scene: &Scene, triangles: &[Triangle]) -> Vec<bool> {
    let mut used = vec![false; scene.materials.len()];
    for triangle in triangles {
        used[triangle.material(scene)] = true;
    }
    used
}
