//! Scenes of bodies that scatter light inside, for techniques that reuse it.

use crate::half_sky::waxy;
use glam::dcamera::rh::view::look_at_affine3;
use glam::{DAffine3, DQuat, DVec3};
use restir_host::scene::subsurface::medium;
use restir_host::scene::{
    Attachment, Camera, Interpolation, Material, Mesh, Motion, Node, Part, Placement, Pose, Property, Scene, Track,
    builtin,
};

/// A scene by its name, if there is one.
///
/// * `ball`, `block`, `torus`: a body beside a small lamp;
/// * `ball-DIAMETERS`, `ball-0.01` for instance: a ball in which light flies so far, see [`ball`];
/// * `comb`: ten thin plates that are one body, of which a segment meets up to twenty sides, more than are listed;
/// * `open`: a ball without its bottom;
/// * `touching`: two bodies that lie on each other;
/// * `marble-statue`, `skin-statue`: the built-in hare of marble, ten centimetres large, and of skin, two metres large;
/// * `turning-statue`: the latter turns, and so does all that is seen of it;
/// * `passing-statue`: the same stands, and the camera passes by;
/// * `marble-hall`: a closed room whose floor and column are of marble.
pub fn named(name: &str) -> Option<Scene> {
    let scene = match name {
        "ball" => lit(sphere()),
        "block" => lit(Mesh::cuboid(DVec3::new(-0.5, -0.6, -0.4), DVec3::new(0.6, 0.5, 0.5))),
        "torus" => lit(torus()),
        "comb" => lit(comb()),
        "open" => lit(open()),
        "touching" => touching(),
        "marble-statue" => statue("marble", None),
        "skin-statue" => statue("skin1", Some(0.1)),
        "turning-statue" => turning(statue("skin1", Some(0.1))),
        "passing-statue" => passing(statue("skin1", Some(0.1))),
        "marble-hall" => marble_hall(),
        _ => ball(name.strip_prefix("ball-")?.parse().ok().filter(|diameters| *diameters > 0.0)?),
    };
    Some(Scene { name: name.to_owned(), ..scene })
}

/// The ball alone, under a light that all of what is seen of it sees as a whole; light of the red channel flies so many of its diameters from collision to collision in the mean.
pub fn ball(diameters: f32) -> Scene {
    let flights = [1.6, 0.96, 0.48].map(|flight| flight * diameters);
    let mut scene = seen();
    let wax = scene.add_material(waxy([0.9, 0.7, 0.5], flights));
    scene.add_mesh("body", wax, sphere());
    scene.add_quad_light(DVec3::new(0.0, 2.5, 1.8), [DVec3::X, DVec3::new(0.0, -0.7, 0.7)], [9.0, 8.0, 6.0], false);
    scene
}

fn sphere() -> Mesh {
    Mesh::sphere(DVec3::ZERO, 0.8, 4)
}

/// A body of wax with a small lamp beside it, whose light goes far in relation to its size. What a ball has around a point it has around each, so
/// that replay has a Jacobian of 1 there; a block has edges.
fn lit(body: Mesh) -> Scene {
    let mut scene = seen();
    let wax = scene.add_material(waxy([0.9, 0.7, 0.5], [0.5, 0.3, 0.15]));
    scene.add_mesh("body", wax, body);
    let floor = scene.add_material(Material::diffuse("floor", [0.5; 3]));
    scene.add_mesh("floor", floor, Mesh::quad(DVec3::new(-4.0, -0.81, 4.0), [DVec3::X * 8.0, DVec3::Z * -8.0]));
    scene.add_sphere_light(DVec3::new(0.5, 0.7, 0.7), 0.12, [9.0, 8.0, 6.0]);
    scene
}

fn seen() -> Scene {
    let camera = Camera::pinhole(DVec3::new(0.4, 1.0, 2.8), DVec3::ZERO, DVec3::Y, 0.6);
    Scene { camera: Some(camera), ..Scene::default() }
}

fn torus() -> Mesh {
    let turn = |k: u32| std::f64::consts::TAU * f64::from(k) / 24.0;
    let profile: Vec<_> = (0..=24).map(|k| [0.6 + 0.25 * turn(k).cos(), 0.25 * turn(k).sin()]).collect();
    Mesh::lathe(&profile, 48)
}

fn comb() -> Mesh {
    let plate = |k: u32| {
        let x = 0.08 * f64::from(k) - 0.4;
        Mesh::cuboid(DVec3::new(x, -0.6, -0.4), DVec3::new(x + 0.02, 0.5, 0.4))
    };
    Mesh::union(&(0..10).map(plate).collect::<Vec<_>>())
}

fn open() -> Mesh {
    let mut ball = sphere();
    let is_above = |triangle: &[u32; 3]| triangle.iter().all(|&i| ball.positions[i as usize][1] > -0.3);
    ball.indices = ball.indices.iter().copied().filter(is_above).collect();
    ball
}

fn touching() -> Scene {
    let mut scene = lit(Mesh::cuboid(DVec3::new(-0.5, -0.6, -0.4), DVec3::new(0.0, 0.5, 0.5)));
    let jade = scene.add_material(waxy([0.3, 0.9, 0.5], [0.2, 0.4, 0.3]));
    scene.add_mesh("beside", jade, Mesh::cuboid(DVec3::new(0.0, -0.6, -0.4), DVec3::new(0.5, 0.5, 0.5)));
    scene
}

fn statue(medium: &str, scale: Option<f64>) -> Scene {
    let mut scene = builtin::scene("statue").expect("built in");
    scene.fill(medium, scale).expect("the hare is a body");
    // it fills the picture
    scene.camera = scene.camera.map(|camera| Camera { vertical_fov: 0.8 * camera.vertical_fov, ..camera });
    scene
}

/// By two degrees a frame.
fn turning(mut scene: Scene) -> Scene {
    let instance = scene.instances.iter().position(|i| scene.meshes[i.mesh].name == "statue").expect("it is there");
    let pose = |frame: u32| Pose {
        time: f64::from(frame),
        translation: DVec3::ZERO,
        rotation: DQuat::from_rotation_y(f64::from(2 * frame).to_radians()),
    };
    scene.animation.motions.push(Motion { instance, keys: (0..16).map(pose).collect() });
    scene
}

/// The camera moves to its right by as much a frame as the statue moves by some two of 32 columns.
fn passing(mut scene: Scene) -> Scene {
    let camera = scene.camera.expect("it is seen");
    let right = (camera.target - camera.position).cross(camera.up).normalize();
    let rig = &mut scene.animation.rig;
    let mut node = |name: &str, parent, placement| {
        rig.nodes.push(Node { name: name.to_owned(), parent, placement, weights: Vec::new() });
        rig.nodes.len() - 1
    };
    let at_rest = Placement::Parts { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
    let rail = node("rail", None, at_rest);
    let stand = look_at_affine3(camera.position, camera.target, camera.up).inverse();
    let node = node("camera", Some(rail), Placement::Matrix(stand));
    rig.attachments.push(Attachment { node, part: Part::Camera });
    let frames = 0..16_u8;
    rig.tracks.push(Track {
        node: rail,
        property: Property::Translation,
        interpolation: Interpolation::Linear,
        times: frames.clone().map(f32::from).collect(),
        values: frames.flat_map(|frame| (right * (0.12 * f64::from(frame))).as_vec3().to_array()).collect(),
    });
    scene
}

/// Light comes from under the ceiling alone; the column stands just above the floor.
fn marble_hall() -> Scene {
    let camera = Camera::pinhole(DVec3::new(0.5, 1.3, 1.8), DVec3::new(0.0, 0.8, -0.4), DVec3::Y, 0.9);
    let mut scene = Scene { camera: Some(camera), ..Scene::default() };
    let volume = Some(medium("marble", 0.02).expect("a medium that there is"));
    let marble = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("marble", [1.0; 3]) };
    let marble = scene.add_material(marble);
    scene.add_mesh("floor", marble, Mesh::cuboid(DVec3::new(-1.99, -0.5, -1.99), DVec3::new(1.99, 0.0, 1.99)));
    let column =
        [[0.0, 0.0], [0.4, 0.0], [0.4, 0.15], [0.28, 0.25], [0.24, 1.25], [0.36, 1.4], [0.36, 1.5], [0.0, 1.5]];
    let column = Mesh::lathe(&column.map(|[radius, y]| [radius, y + 0.005]), 24);
    scene.place_mesh("column", marble, column, DAffine3::from_translation(DVec3::new(-0.2, 0.0, -0.5)));
    let plaster = scene.add_material(Material::diffuse("plaster", [0.6, 0.58, 0.55]));
    let mut walls = Mesh::cuboid(DVec3::new(-2.0, -0.6, -2.0), DVec3::new(2.0, 2.5, 2.0));
    walls.indices.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    scene.add_mesh("walls", plaster, walls);
    scene.add_quad_light(DVec3::new(-1.0, 2.4, -0.4), [DVec3::X * 1.2, DVec3::Z * 1.2], [8.0, 7.4, 6.4], false);
    scene
}
