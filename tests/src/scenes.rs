//! Test scenes as data, in the forms of the kernels and of the [`oracle`].

use crate::bodies;
use crate::masks::{self, Form};
use crate::oracle::{self, Oracle};
use crate::panes::Panes;
use crate::random::SplitMix;
use crate::sheets::Sheets;
use glam::DVec3;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{
    AlphaMode, Camera, Environment, Filter, Light, LightKind, Material, Mesh, Motion, Scene, Texture, TextureUse,
    Volume, VolumeScattering, Wrap, builtin,
};
use restir_shared::layout::CameraParams;
use restir_shared::technique::path::{PathFlags, PathParams};
use std::sync::Arc;

/// A planar quadrilateral, its corners counter-clockwise as seen from the front, with the index of its material.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    /// Corners.
    pub corners: [[f32; 3]; 4],
    /// Index into [`Setting::materials`].
    pub material: usize,
}

/// A scene and how it is looked at.
#[derive(Clone, Debug)]
pub struct Setting {
    /// For messages.
    pub name: &'static str,
    /// Surfaces.
    pub quads: Vec<Quad>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Centre of projection; the camera looks along -z.
    pub eye: [f32; 3],
    /// Half the height of the image plane at distance 1.
    pub half_height: f32,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Longest path in segments.
    pub max_depth: u32,
}

pub(crate) fn matte(reflectance: [f32; 3]) -> Material {
    Material::diffuse("", reflectance)
}

pub(crate) const fn quad(material: usize, corners: [[f32; 3]; 4]) -> Quad {
    Quad { corners, material }
}

/// A box that is open to the viewer, with a block and a light that fills half of the ceiling.
pub fn room() -> Setting {
    Setting {
        name: "room",
        quads: vec![
            quad(0, [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0]]),
            quad(0, [[-1.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]),
            quad(0, [[-1.0, -1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, -1.0]]),
            quad(1, [[-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]]),
            quad(2, [[1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]]),
            quad(3, [[-0.75, 0.9, -0.75], [0.75, 0.9, -0.75], [0.75, 0.9, 0.75], [-0.75, 0.9, 0.75]]),
            // the block: top, front, right
            quad(0, [[-0.6, 0.0, 0.3], [0.1, 0.0, 0.5], [0.3, 0.0, -0.2], [-0.4, 0.0, -0.4]]),
            quad(0, [[-0.6, -1.0, 0.3], [0.1, -1.0, 0.5], [0.1, 0.0, 0.5], [-0.6, 0.0, 0.3]]),
            quad(0, [[0.1, -1.0, 0.5], [0.3, -1.0, -0.2], [0.3, 0.0, -0.2], [0.1, 0.0, 0.5]]),
        ],
        materials: vec![
            matte([0.75, 0.7, 0.65]),
            matte([0.6, 0.3, 0.25]),
            matte([0.25, 0.5, 0.3]),
            Material::emitter("", [0.5; 3], [3.0, 2.5, 2.0]),
        ],
        eye: [0.1, 0.05, 3.6],
        half_height: 0.4,
        size: [32, 32],
        max_depth: 6,
    }
}

/// An open scene: a coloured floor, a tilted emitter that shines from both sides, a smaller one that shines from its
/// front alone and turns its back to a wall, and an occluder.
pub fn terrace() -> Setting {
    Setting {
        name: "terrace",
        quads: vec![
            quad(0, [[-2.0, -1.0, 2.0], [2.0, -1.0, 2.0], [2.0, -1.0, -2.0], [-2.0, -1.0, -2.0]]),
            quad(1, [[-2.0, -1.0, -2.0], [2.0, -1.0, -2.0], [2.0, 1.5, -2.0], [-2.0, 1.5, -2.0]]),
            // tilted around z
            quad(2, [[-1.6, 0.6, 1.0], [-1.6, 0.6, -1.2], [0.0, 1.3, -1.2], [0.0, 1.3, 1.0]]),
            // faces the viewer
            quad(3, [[0.6, -0.6, -1.4], [1.6, -0.6, -1.4], [1.6, 0.3, -1.4], [0.6, 0.3, -1.4]]),
            quad(0, [[-0.9, -0.5, 0.5], [0.1, -0.4, 0.6], [0.1, -0.3, -0.5], [-0.9, -0.4, -0.6]]),
        ],
        materials: vec![
            matte([0.7, 0.45, 0.3]),
            matte([0.4, 0.5, 0.7]),
            Material { two_sided_emission: true, ..Material::emitter("", [0.3; 3], [2.0, 2.5, 3.0]) },
            Material::emitter("", [0.2, 0.3, 0.4], [5.0, 3.0, 2.0]),
        ],
        eye: [0.0, 0.1, 4.2],
        half_height: 0.45,
        size: [32, 32],
        max_depth: 5,
    }
}

/// Lights of [`penumbra`] and [`spread`].
pub const ROW: usize = 24;
/// Index of the board of [`penumbra`] among its quads.
pub const BOARD: usize = 1;

/// A wall that fills the picture, lit past a board by a row of [`ROW`] small lights out of sight; `emission` is that of
/// each, by its place from 0 to 1. The shadows of the lights lie side by side: hardly a place is in full shadow, and much
/// of the wall in part.
pub fn penumbra(emission: impl Fn(f32) -> [f32; 3]) -> Setting {
    let wall = [[-1.2, -1.2, 0.0], [1.2, -1.2, 0.0], [1.2, 1.2, 0.0], [-1.2, 1.2, 0.0]];
    let board = [[-0.35, 0.25, 0.45], [0.35, 0.25, 0.45], [0.35, 0.65, 0.45], [-0.35, 0.65, 0.45]];
    let mut quads = vec![quad(0, wall), quad(0, board)];
    let mut materials = vec![matte([0.7; 3])];
    for i in 0..ROW {
        let place = (i as f32 + 0.5) / ROW as f32;
        let (x, half) = (2.4 * place - 1.2, 0.03);
        // faces the wall's middle: tilted around x
        let corner = |across: f32, along: f32| [x + across * half, 1.6 - 0.6 * along * half, 1.2 + 0.8 * along * half];
        quads.push(quad(1 + i, [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]));
        materials.push(Material::emitter("", [0.7; 3], emission(place)));
    }
    let eye = [0.0, 0.0, 3.0];
    Setting { name: "penumbra", quads, materials, eye, half_height: 1.0 / 3.0, size: [64, 64], max_depth: 2 }
}

/// White, for [`penumbra`].
pub fn white(_: f32) -> [f32; 3] {
    [40.0; 3]
}

/// From red by way of green to blue, each light with some white in it, for [`penumbra`].
pub fn coloured(place: f32) -> [f32; 3] {
    let near = |center: f32| 10.0 + 60.0 * (1.0 - 2.0 * (place - center).abs()).max(0.0);
    [near(0.0), near(0.5), near(1.0)]
}

/// Power to which the random numbers of a hue are taken in [`spread`]: few lights are nearly white then.
const HUE_POWER: i32 = 4;

/// A wall past a board under [`ROW`] point lights, whose places, intensities and hues have nothing to do with each other:
/// the flat experiment of seed 002's specification (appendix A4), with both directions of the wall as its one direction
/// there. The wall reaches from -2 to 2, the board, 0.7 before it, from -0.6 to 0.5; the lights are uniform within 3 of the
/// middle and 1.5 to 3 before the wall, their intensities in 0.5 to 4. A hue is three uniform numbers to the fourth power,
/// over the largest; without `coloured` all are white, in the same places. The camera stands between wall and board.
pub fn spread(coloured: bool) -> Scene {
    let square = |lo: f32, hi: f32, z: f32| [[lo, lo, z], [hi, lo, z], [hi, hi, z], [lo, hi, z]];
    let setting = Setting {
        name: "spread",
        quads: vec![quad(0, square(-2.0, 2.0, 0.0)), quad(0, square(-0.6, 0.5, 0.7))],
        materials: vec![matte([0.7; 3])],
        eye: [0.0, 0.0, 0.5],
        half_height: 4.0,
        size: [64, 64],
        max_depth: 2,
    };
    let mut random = SplitMix::new(ROW as u64);
    let light = |_| {
        let [x, y] = [(); 2].map(|()| random.range(-3.0, 3.0));
        let position = DVec3::new(x, y, random.range(1.5, 3.0));
        let power = random.range(0.5, 4.0);
        let hue = [(); 3].map(|()| random.unit().powi(HUE_POWER));
        let largest = hue.into_iter().fold(0.0, f64::max);
        let intensity = hue.map(|channel| (power * if coloured { channel / largest } else { 1.0 }) as f32);
        Light { name: String::new(), intensity, kind: LightKind::Point { position } }
    };
    let lights = (0..ROW).map(light).collect();
    Scene { lights, ..setting.scene() }
}

impl Setting {
    /// For the oracle; paths go through the pixels' whole area.
    pub fn oracle(&self) -> Oracle {
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let triangles = self.quads.iter().flat_map(|quad| {
            let material = &self.materials[quad.material];
            let [a, b, c, d] = quad.corners.map(wide);
            [[a, b, c], [a, c, d]].map(|vertices| oracle::Triangle {
                vertices,
                reflectance: wide(material.base_color),
                emission: wide(material.emission),
                two_sided: material.two_sided_emission,
            })
        });
        Oracle::new(triangles, oracle::Camera::new(&self.camera(), self.size), self.max_depth, true)
    }

    /// As a user would write it.
    pub fn scene(&self) -> Scene {
        let eye = DVec3::from(self.eye.map(f64::from));
        let mut scene = Scene {
            name: self.name.to_owned(),
            materials: self.materials.clone(),
            camera: Some(Camera::pinhole(eye, eye - DVec3::Z, DVec3::Y, 2.0 * f64::from(self.half_height).atan())),
            default_size: Some(self.size),
            ..Scene::default()
        };
        for Quad { corners, material } in &self.quads {
            let indices = vec![[0, 1, 2], [0, 2, 3]];
            scene.add_mesh("", *material, Mesh { positions: corners.to_vec(), indices, ..Mesh::default() });
        }
        scene
    }

    /// For the kernels.
    ///
    /// # Panics
    /// If the host refuses the scene.
    pub fn buffers(&self) -> SceneBuffers {
        SceneBuffers::build(&self.scene()).expect("a test scene is valid")
    }

    /// The camera for the kernels, with exactly the oracle's numbers.
    pub fn camera(&self) -> CameraParams {
        CameraParams {
            position: self.eye,
            inv_width: 1.0 / self.size[0] as f32,
            forward: [0.0, 0.0, -1.0],
            inv_height: 1.0 / self.size[1] as f32,
            right: [self.half_height * self.size[0] as f32 * (1.0 / self.size[1] as f32), 0.0, 0.0],
            up: [0.0, self.half_height, 0.0],
            ..CameraParams::default()
        }
    }

    /// Parameters of one sample a pixel.
    pub fn params(&self, buffers: &SceneBuffers, flags: PathFlags) -> PathParams {
        let camera = self.camera();
        PathParams { camera, flags, ..path_params(buffers, self.size, self.max_depth) }
    }
}

/// Parameters of one path a pixel, through its centre, as the scene's camera sees it.
pub fn path_params(buffers: &SceneBuffers, [width, height]: [u32; 2], max_depth: u32) -> PathParams {
    let camera = buffers.camera.params(width, height);
    PathParams { scene: buffers.header, camera, width, height, max_depth, ..PathParams::default() }
}

/// A scene of [`named`] or a file, for the kernels.
///
/// # Errors
/// As of [`Scene::load`] and [`SceneBuffers::build`].
pub fn buffers(name: &str) -> Result<SceneBuffers, Error> {
    SceneBuffers::build(&named(name).map_or_else(|| Scene::load(name), Ok)?)
}

/// A built-in scene, or one of [`bodies`] or of the harness: [`statue_by_night`], [`all_lights`], [`Panes`], [`unlit`], [`masks`], [`Sheets`] with
/// glass, and [`moving_alpha`], among others, by `statue-by-night`, `all-lights`, `coats`, `panes`, `unlit`, `masks`, `sheets` and `moving-alpha`.
pub fn named(name: &str) -> Option<Scene> {
    match name {
        "statue-by-night" => Some(statue_by_night()),
        "all-lights" => Some(all_lights()),
        "coats" => Some(coats()),
        "unlit" => Some(unlit()),
        "masks" => Some(masks::scene(Form::Masked)),
        "sheets" => Some(Sheets { glass: true }.scene()),
        "moving-alpha" => Some(moving_alpha()),
        "cornell-lens" => Some(cornell_lens()),
        "moving-fast" => Some(moving_fast()),
        "moving-media" => Some(moving_media()),
        "clear-media" => Some(clear_media()),
        "moving-mist" => Some(moving_mist()),
        "panes" => Some(Panes { coloured: true, count: 2 }.scene()),
        _ => bodies::named(name).or_else(|| builtin::scene(name)),
    }
}

/// The built-in box, seen through a lens that blurs all but its back wall.
fn cornell_lens() -> Scene {
    let mut scene = Scene { name: "cornell-lens".to_owned(), ..builtin::scene("cornell").expect("built in") };
    scene.camera = scene.camera.map(|camera| Camera { lens_radius: 0.05, ..camera });
    scene
}

/// The built-in moving room, in which a frame takes the time of four.
fn moving_fast() -> Scene {
    let mut scene = Scene { name: "moving-fast".to_owned(), ..builtin::scene("moving").expect("built in") };
    scene.animation.frame_rate *= 0.25;
    scene
}

/// The built-in moving room, in which the board is a mask, and sign and ball are blended.
pub fn moving_alpha() -> Scene {
    let mut scene = Scene { name: "moving-alpha".to_owned(), ..builtin::scene("moving").expect("built in") };
    let texels = (0..16).map(|i| [255, 255, 255, if i * i % 7 < 4 { 255 } else { 0 }]).collect();
    let (wrap, filter) = ([Wrap::Repeat; 2], Filter::Linear);
    scene.textures.push(Texture { name: "holes".to_owned(), size: [4, 4], texels, wrap, filter });
    let modes = [("board", AlphaMode::Mask { cutoff: 0.5 }), ("sign", AlphaMode::Blend), ("ball", AlphaMode::Blend)];
    for (name, alpha_mode) in modes {
        let material = scene.materials.iter_mut().find(|material| material.name == name).expect("it is there");
        (material.alpha, material.alpha_mode) = (0.7, alpha_mode);
        if name != "ball" {
            material.base_color_texture = Some(TextureUse::new(0));
        }
    }
    scene
}

/// The built-in moving room, in which the ball is of a medium behind glass whose colour is textured, the lamp shines inside of a block of wax that
/// moves with it, and the bulb inside of another one, that does not scatter everywhere.
pub fn moving_media() -> Scene {
    let mut scene = Scene { name: "moving-media".to_owned(), ..builtin::scene("moving").expect("built in") };
    let texels = (0..16).map(|i| [255 - 15 * i, 90 + 10 * i, 200, if i % 5 == 0 { 0 } else { 255 - 9 * i }]).collect();
    let (wrap, filter) = ([Wrap::Mirror; 2], Filter::Linear);
    scene.textures.push(Texture { name: "veins".to_owned(), size: [4, 4], texels, wrap, filter });
    let medium = |color_texture, strength_texture, anisotropy| {
        let volume = Volume::scattering([0.9, 0.8, 0.6], [0.2, 0.1, 0.05], anisotropy);
        let scattering = volume.scattering.map(|s| VolumeScattering { color_texture, strength_texture, ..s });
        Some(Volume { scattering, ..volume })
    };
    let veins = Some(TextureUse { transform: [2.0, 0.3, 0.1, -0.2, 1.5, 0.0], ..TextureUse::new(0) });
    let ball = scene.materials.iter_mut().find(|material| material.name == "ball").expect("it is there");
    (ball.transmission, ball.volume) = (1.0, medium(veins, None, 0.5));
    let wax = |name, volume| Material { diffuse_transmission: 1.0, volume, ..Material::diffuse(name, [1.0; 3]) };
    let shade = scene.add_material(wax("shade", medium(None, None, -0.3)));
    let patchy = scene.add_material(wax("patchy", medium(veins, Some(TextureUse::new(0)), 0.0)));
    let lamp = scene.instances.iter().position(|i| scene.meshes[i.mesh].name == "lamp").expect("it is there");
    let half = DVec3::new(0.2, 0.1, 0.14);
    scene.place_mesh("shade", shade, Mesh::cuboid(-half, half), scene.instances[lamp].transform);
    let keys = scene.animation.motions.iter().find(|motion| motion.instance == lamp).expect("it moves").keys.clone();
    scene.animation.motions.push(Motion { instance: scene.instances.len() - 1, keys });
    let around = DVec3::new(0.7, -0.3, 0.3);
    scene.add_mesh("patchy", patchy, Mesh::cuboid(around - DVec3::splat(0.16), around + DVec3::splat(0.14)));
    // moved with the shade that it lies in
    let bead = Material { transmission: 1.0, roughness: 0.2, ior: 1.4, ..wax("bead", medium(veins, None, 0.3)) };
    let bead = scene.add_material(bead);
    scene.place_mesh("bead", bead, Mesh::cuboid(half * -0.6, half * 0.5), scene.instances[lamp].transform);
    let keys = scene.animation.motions.last().expect("the shade moves").keys.clone();
    scene.animation.motions.push(Motion { instance: scene.instances.len() - 1, keys });
    for mesh in scene.meshes.iter_mut().filter(|mesh| mesh.name == "ball").map(Arc::make_mut) {
        mesh.uvs = mesh.positions.iter().map(|[x, y, _]| [4.0 * x, 4.0 * y]).collect();
    }
    scene
}

/// A ball and a block of mist, whose borders light passes straight, with a pebble and a lamp inside; a lamp, a bulb and a sky outside.
pub fn clear_media() -> Scene {
    let camera = Camera::pinhole(DVec3::new(0.6, 1.8, 4.0), DVec3::new(0.1, 0.5, 0.0), DVec3::Y, 0.55);
    let mut scene = Scene { name: "clear-media".to_owned(), camera: Some(camera), ..Scene::default() };
    let mut mist = |lengths, g| {
        let volume = Some(Volume::scattering([0.9, 0.8, 0.6], lengths, g));
        let white = Material::diffuse("mist", [1.0; 3]);
        scene.add_material(Material { ior: 1.0, transmission: 1.0, roughness: 0.0, volume, ..white })
    };
    let [thin, thick] = [mist([1.5, 0.8, 0.5], 0.5), mist([0.3, 0.2, 0.1], -0.2)];
    let [stone, floor] = [[0.4, 0.5, 0.6], [0.5, 0.45, 0.4]].map(|c| scene.add_material(Material::diffuse("matt", c)));
    let faceted = |centre, radius| Mesh { normals: Vec::new(), ..Mesh::sphere(centre, radius, 3) };
    scene.add_mesh("ball", thin, faceted(DVec3::new(-0.55, 0.7, 0.0), 0.6));
    scene.add_mesh("pebble", stone, faceted(DVec3::new(-0.4, 0.5, 0.2), 0.15));
    scene.add_mesh("block", thick, Mesh::cuboid(DVec3::new(0.35, 0.05, -0.5), DVec3::new(1.15, 0.9, 0.3)));
    scene.add_mesh("floor", floor, Mesh::quad(DVec3::new(-4.0, 0.0, 4.0), [DVec3::X * 8.0, DVec3::Z * -8.0]));
    scene.add_sphere_light(DVec3::new(0.7, 0.5, 0.0), 0.15, [3.0, 4.0, 5.0]);
    scene.add_quad_light(DVec3::new(-0.9, 2.2, -0.4), [DVec3::X * 0.6, DVec3::Z * 0.6], [9.0, 8.0, 7.0], false);
    let kind = LightKind::Point { position: DVec3::new(1.6, 1.2, 0.8) };
    scene.lights.push(Light { name: "bulb".to_owned(), intensity: [0.5, 0.4, 0.3], kind });
    let pixel = |i: u32| [0.2 + 0.1 * (i % 8) as f32, 0.3, 0.5 - 0.1 * (i / 8) as f32];
    scene.environment = Some(Environment {
        name: "sky".to_owned(),
        size: [8, 4],
        pixels: (0..32).map(pixel).collect::<Vec<_>>().into(),
        scale: 1.0,
        rotation: 20.0,
    });
    scene
}

/// [`moving_media`], in which the ball is of mist and has facets: light passes its border straight.
fn moving_mist() -> Scene {
    let mut scene = Scene { name: "moving-mist".to_owned(), ..moving_media() };
    let ball = scene.materials.iter_mut().find(|material| material.name == "ball").expect("it is there");
    *ball = Material { ior: 1.0, roughness: 0.0, base_color: [1.0; 3], ..ball.clone() };
    ball.volume = Some(Volume::scattering([0.9, 0.8, 0.6], [0.2, 0.1, 0.05], 0.5));
    scene.meshes.iter_mut().filter(|mesh| mesh.name == "ball").for_each(|mesh| Arc::make_mut(mesh).normals.clear());
    scene
}

/// The built-in cornell box without its light.
pub fn unlit() -> Scene {
    let mut scene = Scene { name: "unlit".to_owned(), ..builtin::scene("cornell").expect("built in") };
    scene.materials.iter_mut().for_each(|material| material.emission = [0.0; 3]);
    scene
}

/// The built-in statue, with the small bright lights of the built-in tower's sky in place of its own.
pub fn statue_by_night() -> Scene {
    let [statue, tower] = ["statue", "tower"].map(|name| builtin::scene(name).expect("built in"));
    let mut scene = Scene { name: "statue-by-night".to_owned(), environment: tower.environment, ..statue };
    scene.materials.iter_mut().for_each(|material| material.emission = [0.0; 3]);
    scene
}

/// [`all_lights`], in which textures scale what the glossy surfaces reflect.
pub fn coats() -> Scene {
    let mut scene = Scene { name: "coats".to_owned(), ..all_lights() };
    let texels = (0..16).map(|i| [40 * (i % 7), 255 - 17 * i, 90, 17 * i]).collect();
    let (wrap, filter) = ([Wrap::Mirror; 2], Filter::Linear);
    scene.textures.push(Texture { name: "scratches".to_owned(), size: [4, 4], texels, wrap, filter });
    let glossy = scene.materials.iter().position(|material| material.name == "glossy").expect("it is there");
    scene.materials[glossy].specular_texture = Some(TextureUse::new(0));
    scene.materials[glossy].specular_color_texture = Some(TextureUse::new(0));
    scene.materials[glossy].specular_color = [1.0, 2.0, 9.0];
    for mesh in scene.meshes.iter_mut().map(Arc::make_mut).filter(|mesh| mesh.material == glossy) {
        mesh.uvs = mesh.positions.iter().map(|[x, y, _]| [3.0 * x, 3.0 * y]).collect();
    }
    scene
}

/// A stage under every kind of light: surfaces that emit from one side and from both, a lamp, a spot, the sun, a sky.
/// The surfaces are matte, glossy, and a mirror.
pub fn all_lights() -> Scene {
    let eye = DVec3::new(0.3, 1.5, 4.4);
    let pixel =
        |i: u32| [[0.10, 0.14, 0.2], [0.02, 0.02, 0.03]][(i / 32) as usize].map(|x| x * (1 + i % 8) as f32 * 0.5);
    let lamp = |name: &str, intensity, kind| Light { name: name.to_owned(), intensity, kind };
    let mut scene = Scene {
        name: "all-lights".to_owned(),
        camera: Some(Camera::pinhole(eye, DVec3::new(0.0, 0.75, 0.0), DVec3::Y, 40.0_f64.to_radians())),
        environment: Some(Environment {
            name: "sky".to_owned(),
            size: [8, 8],
            pixels: (0..64).map(pixel).collect(),
            scale: 1.0,
            rotation: 30.0,
        }),
        lights: vec![
            lamp("lamp", [1.6, 1.0, 0.6], LightKind::Point { position: DVec3::new(-0.9, 0.9, 1.2) }),
            lamp(
                "spot",
                [2.0, 4.0, 6.0],
                LightKind::Spot {
                    position: DVec3::new(1.4, 2.4, 1.0),
                    direction: DVec3::new(-0.6, -1.0, -0.3),
                    inner: 0.2,
                    outer: 0.5,
                },
            ),
            lamp("sun", [0.6, 0.5, 0.4], LightKind::Directional { direction: DVec3::new(0.5, -1.0, -0.8) }),
        ],
        ..Scene::default()
    };
    let floor = scene.add_material(Material::diffuse("floor", [0.6, 0.55, 0.5]));
    let glossy =
        scene.add_material(Material { roughness: 0.35, ior: 1.5, ..Material::diffuse("glossy", [0.3, 0.4, 0.6]) });
    let mirror = scene.add_material(Material {
        metallic: 1.0,
        roughness: 0.0,
        ior: 1.5,
        ..Material::diffuse("mirror", [0.9; 3])
    });
    scene.add_mesh("floor", floor, Mesh::quad(DVec3::new(-3.0, 0.0, -2.0), [DVec3::Z * 5.0, DVec3::X * 6.0]));
    scene.add_mesh("wall", glossy, Mesh::quad(DVec3::new(-3.0, 0.0, -2.0), [DVec3::X * 6.0, DVec3::Y * 3.0]));
    scene.add_mesh("block", glossy, Mesh::cuboid(DVec3::new(-0.2, 0.0, -0.4), DVec3::new(0.5, 0.9, 0.3)));
    scene.add_mesh("ball", floor, Mesh::sphere(DVec3::new(-0.9, 0.36, 0.2), 0.35, 3));
    scene.add_mesh(
        "mirror",
        mirror,
        Mesh::quad(DVec3::new(0.8, 0.0, -1.2), [DVec3::new(0.9, 0.0, 0.7), DVec3::Y * 1.4]),
    );
    let [front, back] = [DVec3::new(-1.4, 2.2, -1.0), DVec3::new(0.2, 1.5, -1.6)];
    scene.add_quad_light(front, [DVec3::X * 0.8, DVec3::new(0.0, 0.3, 0.7)], [5.0, 4.0, 2.5], false);
    scene.add_quad_light(back, [DVec3::new(0.6, 0.0, 0.3), DVec3::Y * 0.3], [2.0, 3.0, 4.0], true);
    scene
}
