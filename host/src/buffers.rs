//! The scene as kernels see it: flattened triangles under a BVH, materials, lights and their alias table, in arenas.

use crate::bvh::{self, Bounds};
use crate::scene::{Camera, MAX_COORDINATE, Material, Scene};
use crate::wide_bvh::WideBvh;
use crate::{Error, alias, memory};
use glam::{DVec3, UVec4, Vec3};
use restir_shared::layout::{
    ALIAS_WORDS, FEATURE_LIGHT_TABLE, LIGHT_WORDS, MATERIAL_TWO_SIDED_EMISSION, MAX_TRIANGLES, NODE_WORDS, NONE,
    SceneHeader,
};
use restir_shared::num::flush;
use restir_shared::scene::SceneView;
use restir_shared::vec::{cross, dot};
use std::sync::{Arc, OnceLock};

/// Emission beyond this could overflow in sums over paths.
const MAX_EMISSION: f32 = 1.0e20;
/// The square of a triangle's doubled area below which it has no normal.
const MIN_AREA_SQUARED: f32 = restir_shared::num::FLUSH_BELOW;
/// Host memory that a triangle takes while the arenas are built: its flattened form, boxes, tree and records.
const BYTES_PER_TRIANGLE: u64 = 400;

/// A scene in its arenas.
#[derive(Clone, Debug)]
pub struct SceneBuffers {
    /// Where the tables are.
    pub header: SceneHeader,
    /// Geometry arena, 4 words of 32 bits to each of the layout's.
    pub geometry: Arc<[u32]>,
    /// Attribute arena.
    pub attributes: Arc<[u32]>,
    /// The scene's feature bits: what kernels may be specialised to.
    pub features: u32,
    /// The camera.
    pub camera: Camera,
    stats: SceneStats,
    wide: OnceLock<Arc<WideBvh>>,
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
    pub lights: u64,
    /// Materials.
    pub materials: u64,
    /// Size of the arenas.
    pub bytes: u64,
    /// Lower and upper corner of the bounds.
    pub bounds: [[f32; 3]; 2],
    /// Names of the feature bits that are set.
    pub features: Vec<&'static str>,
}

/// A triangle in world space.
struct Triangle {
    vertices: [Vec3; 3],
    material: u32,
    object: u32,
}

/// The emitters: their records and, where they differ in power, their alias table.
struct LightTables {
    /// (triangle, density per area)
    lights: Vec<(u32, f32)>,
    alias: Option<Vec<alias::Entry>>,
}

impl SceneBuffers {
    /// Flattens a scene and builds its BVH.
    ///
    /// # Errors
    /// [`Error::Scene`] for a vertex that is not finite or too far away, an index out of range, a material out of
    /// range, or a scene without any triangle of positive area.
    pub fn build(scene: &Scene) -> Result<Self, Error> {
        for material in &scene.materials {
            check_material(scene, material)?;
        }
        let (triangles, skipped) = flatten(scene)?;
        let vertices: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.vertices).collect();
        let bvh = bvh::build(&vertices);
        let triangles: Vec<&Triangle> = bvh.order.iter().map(|&i| &triangles[i as usize]).collect();
        let tables = light_tables(&triangles, &scene.materials);
        let triangle_base = bvh.nodes.len() as u32 * NODE_WORDS;
        let light_base = scene.materials.len() as u32 * restir_shared::layout::MATERIAL_WORDS;
        let light_count = tables.lights.len() as u32;
        let header = SceneHeader {
            bounds_lo: bvh.bounds.lo.to_array(),
            triangle_base,
            bounds_hi: bvh.bounds.hi.to_array(),
            triangle_count: triangles.len() as u32,
            light_base,
            light_count,
            alias_base: if tables.alias.is_some() { light_base + light_count * LIGHT_WORDS } else { NONE },
            root: bvh.root,
        };
        let geometry = pack_geometry(&bvh, &triangles, &tables);
        let attributes = pack_attributes(&scene.materials, &tables);
        let features = if tables.alias.is_some() { FEATURE_LIGHT_TABLE } else { 0 };
        let camera = scene.camera.unwrap_or_else(|| Camera::framing(corners(&bvh.bounds), 1.0));
        check_camera(scene, &camera)?;
        let stats = SceneStats {
            triangles: triangles.len() as u64,
            skipped_triangles: skipped,
            nodes: bvh.nodes.len() as u64,
            bvh_depth: bvh.depth as u32,
            lights: u64::from(light_count),
            materials: scene.materials.len() as u64,
            bytes: (geometry.len() + attributes.len()) as u64 * 4,
            bounds: corners(&bvh.bounds),
            features: feature_names(features),
        };
        Ok(Self { header, geometry: geometry.into(), attributes: attributes.into(), features, camera, stats, wide: OnceLock::new() })
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
            features: self.features,
            tracer: None,
        }
    }

    /// A tree for the CPU with the hits of [`Self::view`], some three times as fast. It is built on the first call.
    pub fn tracer(&self) -> &WideBvh {
        self.wide.get_or_init(|| Arc::new(WideBvh::new(&self.view())))
    }

    /// [`Self::view`] with rays traced by [`Self::tracer`].
    pub fn traced_view(&self) -> SceneView<'_> {
        SceneView { tracer: Some(self.tracer()), ..self.view() }
    }
}

fn corners(bounds: &Bounds) -> [[f32; 3]; 2] {
    [bounds.lo.to_array(), bounds.hi.to_array()]
}

fn feature_names(features: u32) -> Vec<&'static str> {
    if features & FEATURE_LIGHT_TABLE != 0 { vec!["light-table"] } else { Vec::new() }
}

fn scene_error(scene: &Scene, problem: String) -> Error {
    Error::Scene { scene: scene.name.clone(), problem }
}

fn check_camera(scene: &Scene, camera: &Camera) -> Result<(), Error> {
    let direction = camera.target - camera.position;
    // a camera that frames the largest scene stands outside of it
    if camera.position.abs().max_element() <= 4.0 * MAX_COORDINATE && direction.is_finite() && direction.length() > 0.0
    {
        return Ok(());
    }
    let problem = format!("the camera at {} is not within 4.29e9 or looks nowhere; correct it", camera.position);
    Err(scene_error(scene, problem))
}

fn check_material(scene: &Scene, material: &Material) -> Result<(), Error> {
    let problem = if material.reflectance.iter().any(|r| !(0.0..=1.0).contains(r)) {
        format!("reflectance {:?} is outside [0, 1]", material.reflectance)
    } else if material.emission.iter().any(|e| !(0.0..=MAX_EMISSION).contains(e)) {
        format!("emission {:?} is outside [0, {MAX_EMISSION:e}]", material.emission)
    } else {
        return Ok(());
    };
    Err(scene_error(scene, format!("material {:?}: {problem}; correct it in the file", material.name)))
}

/// Refuses what could not be held, before anything is made of it: a small file can place a large mesh many times.
fn check_count(scene: &Scene) -> Result<(), Error> {
    let size =
        |instance: &crate::scene::Instance| scene.meshes.get(instance.mesh).map_or(0, |m| m.indices.len() as u64);
    let count: u64 = scene.instances.iter().map(size).sum();
    if count >= u64::from(MAX_TRIANGLES) {
        return Err(scene_error(scene, format!("has {count} triangles, more than the limit of {MAX_TRIANGLES}")));
    }
    memory::check(count * BYTES_PER_TRIANGLE, &format!("scene {}", scene.name), "choose a smaller scene")
}

/// The triangles of all instances in world space, and how many were skipped for want of area.
fn flatten(scene: &Scene) -> Result<(Vec<Triangle>, u64), Error> {
    check_count(scene)?;
    let mut triangles = Vec::new();
    let mut skipped = 0;
    for (object, instance) in scene.instances.iter().enumerate() {
        let Some(mesh) = scene.meshes.get(instance.mesh) else {
            return Err(scene_error(
                scene,
                format!("instance {object} refers to mesh {}, which does not exist", instance.mesh),
            ));
        };
        if mesh.material >= scene.materials.len() {
            return Err(scene_error(
                scene,
                format!("mesh {:?} refers to material {}, which does not exist", mesh.name, mesh.material),
            ));
        }
        let positions = world_positions(scene, instance.mesh, object)?;
        let flipped = instance.transform.matrix3.determinant() < 0.0;
        for (index, corner) in mesh.indices.iter().enumerate() {
            let [a, b, c] = corner.map(|i| positions.get(i as usize).copied());
            let (Some(a), Some(b), Some(c)) = (a, b, c) else {
                return Err(scene_error(
                    scene,
                    format!("mesh {:?}: triangle {index} refers to a vertex that does not exist", mesh.name),
                ));
            };
            let vertices = if flipped { [a, c, b] } else { [a, b, c] };
            if !has_normal(&vertices) {
                skipped += 1;
            } else {
                triangles.push(Triangle { vertices, material: mesh.material as u32, object: object as u32 });
            }
        }
    }
    if triangles.is_empty() {
        return Err(scene_error(scene, format!("has no triangle with an area ({skipped} without one were skipped)")));
    }
    Ok((triangles, skipped))
}

fn world_positions(scene: &Scene, mesh: usize, object: usize) -> Result<Vec<Vec3>, Error> {
    let transform = scene.instances[object].transform;
    let mesh = &scene.meshes[mesh];
    let place = |(index, p): (usize, &[f32; 3])| {
        let world = transform.transform_point3(DVec3::from_array(p.map(f64::from)));
        if world.abs().max_element() <= MAX_COORDINATE {
            Ok(Vec3::from_array(world.to_array().map(|x| flush(x as f32))))
        } else {
            let problem = format!(
                "mesh {:?}: vertex {index} at {world} is not a finite position within 1.07e9; correct or scale the mesh",
                mesh.name
            );
            Err(scene_error(scene, problem))
        }
    };
    mesh.positions.iter().enumerate().map(place).collect()
}

/// Whether the kernels' own arithmetic finds a normal: slivers whose cross product cancels have none.
fn has_normal(&[a, b, c]: &[Vec3; 3]) -> bool {
    let normal = cross(b - a, c - a);
    dot(normal, normal) >= MIN_AREA_SQUARED
}

fn doubled_area_squared([a, b, c]: &[Vec3; 3]) -> f64 {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a).length_squared()
}

/// Chooses emitters in proportion to their power.
fn light_tables(triangles: &[&Triangle], materials: &[Material]) -> LightTables {
    let mut indices = Vec::new();
    let mut areas = Vec::new();
    let mut powers = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let material = &materials[triangle.material as usize];
        let [r, g, b] = material.emission.map(f64::from);
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if luminance > 0.0 {
            let area = 0.5 * doubled_area_squared(&triangle.vertices).sqrt();
            indices.push(index as u32);
            areas.push(area);
            powers.push(area * luminance * if material.two_sided_emission { 2.0 } else { 1.0 });
        }
    }
    let entries = alias::build(&powers);
    let probabilities = alias::probabilities(powers.len(), entries.as_deref());
    let density = |i: usize| flush((probabilities[i] / areas[i]) as f32);
    let lights = indices.iter().enumerate().map(|(i, &triangle)| (triangle, density(i))).collect();
    LightTables { lights, alias: entries }
}

/// Magnitudes below 2^-100 are zero in the arenas, see DETERMINISM.md.
fn float_word(v: Vec3, w: u32) -> [u32; 4] {
    let bits = |x| flush(x).to_bits();
    [bits(v.x), bits(v.y), bits(v.z), w]
}

fn pack_geometry(bvh: &bvh::Bvh, triangles: &[&Triangle], tables: &LightTables) -> Vec<u32> {
    let mut light_of = vec![NONE; triangles.len()];
    for (light, &(triangle, _)) in tables.lights.iter().enumerate() {
        light_of[triangle as usize] = light as u32;
    }
    let nodes = bvh.nodes.iter().flat_map(|node| {
        let [a, b] = node.bounds;
        let [left, right] = node.children;
        [float_word(a.lo, left), float_word(a.hi, right), float_word(b.lo, 0), float_word(b.hi, 0)]
    });
    let triangles = triangles.iter().zip(light_of).flat_map(|(t, light)| {
        let [a, b, c] = t.vertices;
        [float_word(a, t.material), float_word(b, light), float_word(c, t.object)]
    });
    nodes.chain(triangles).flatten().collect()
}

fn pack_attributes(materials: &[Material], tables: &LightTables) -> Vec<u32> {
    let materials = materials.iter().flat_map(|m| {
        let flags = if m.two_sided_emission { MATERIAL_TWO_SIDED_EMISSION } else { 0 };
        [float_word(Vec3::from_array(m.reflectance), flags), float_word(Vec3::from_array(m.emission), 0)]
    });
    let lights = tables.lights.iter().map(|&(triangle, density)| [triangle, density.to_bits(), 0, 0]);
    let alias = tables.alias.iter().flatten().map(|entry| [entry.threshold.to_bits(), entry.alias, 0, 0]);
    const { assert!(LIGHT_WORDS == 1 && ALIAS_WORDS == 1) };
    materials.chain(lights).chain(alias).flatten().collect()
}
