//! Cameras, materials, textures and skies that several scenes use.

use glam::DVec3;

use crate::scene::{Camera, Environment, Filter, Material, Mesh, Scene, Texture, TextureUse, UvSet, Volume, Wrap};

/// Index of refraction of glass, and of what is called plastic.
pub(super) const IOR: f32 = 1.5;

/// An empty scene of a default size, seen from a position towards a target through a pinhole, `degrees` from the lower to
/// the upper edge of the image.
pub(super) fn stage(name: &str, [position, target]: [DVec3; 2], degrees: f64, size: [u32; 2]) -> Scene {
    let camera = Camera::pinhole(position, target, DVec3::Y, degrees.to_radians());
    Scene { name: name.to_owned(), camera: Some(camera), default_size: Some(size), ..Scene::default() }
}

/// A dielectric over a diffuse base.
pub(super) fn plastic(name: &str, base_color: [f32; 3], roughness: f32) -> Material {
    Material { roughness, ior: IOR, ..Material::diffuse(name, base_color) }
}

/// A metal; a mirror where `roughness` is zero.
pub(super) fn metal(name: &str, reflectance: [f32; 3], roughness: f32) -> Material {
    Material { metallic: 1.0, ..plastic(name, reflectance, roughness) }
}

/// A clear interior behind a closed surface.
pub(super) fn glass(name: &str, roughness: f32) -> Material {
    tinted_glass(name, roughness, [1.0; 3], f32::INFINITY)
}

/// As [`glass`], with `color` left of white light after `distance`.
pub(super) fn tinted_glass(name: &str, roughness: f32, color: [f32; 3], distance: f32) -> Material {
    Material {
        transmission: 1.0,
        volume: Some(Volume::absorbing(color, distance)),
        ..plastic(name, [1.0; 3], roughness)
    }
}

/// What lets all light in and out by Lambert's law, without any reflection, to an interior.
pub(super) fn waxy(name: &str, volume: Volume) -> Material {
    Material { diffuse_transmission: 1.0, volume: Some(volume), ..Material::diffuse(name, [1.0; 3]) }
}

/// Adds the diffuse material of a checkered floor of two greys (sRGB, eight bits), `squares` along u and along v.
pub(super) fn checkered_floor(scene: &mut Scene, greys: [u8; 2], squares: [f32; 2]) -> usize {
    let [a, b] = greys.map(|grey| [grey, grey, grey, 255]);
    scene.textures.push(Texture {
        name: "checker".to_owned(),
        size: [2, 2],
        texels: [a, b, b, a].into(),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    });
    let [u, v] = squares.map(|count| 0.5 * count);
    let squares =
        TextureUse { texture: scene.textures.len() - 1, transform: [u, 0.0, 0.0, 0.0, v, 0.0], uv_set: UvSet::First };
    scene.add_material(Material { base_color_texture: Some(squares), ..Material::diffuse("floor", [1.0; 3]) })
}

/// A horizontal square around the origin.
pub(super) fn ground(side: f64) -> Mesh {
    Mesh::quad(DVec3::new(-0.5 * side, 0.0, -0.5 * side), [DVec3::Z * side, DVec3::X * side])
}

/// The floor of a room, and its walls and ceiling, seen from inside.
pub(super) fn room(lo: DVec3, hi: DVec3) -> [Mesh; 2] {
    let [x, y, z] = DVec3::AXES.map(|axis| axis * (hi - lo));
    let shell = [(lo, [y, z]), (lo, [x, y]), (hi, [-x, -z]), (hi, [-z, -y]), (hi, [-y, -x])];
    [Mesh::quad(lo, [z, x]), Mesh::union(&shell.map(|(corner, edges)| Mesh::quad(corner, edges)))]
}

/// Eight triangles whose corners are `radius` away from the middle.
pub(super) fn octahedron(centre: DVec3, radius: f64) -> Mesh {
    let tips = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    Mesh {
        positions: tips.map(|tip| (centre + radius * tip).as_vec3().to_array()).to_vec(),
        indices: vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
        ..Mesh::default()
    }
}

/// An environment from its radiance as a function of the unit direction, taken at the middle of each pixel.
pub(super) fn sky(name: &str, size: [u32; 2], radiance: impl Fn(DVec3) -> [f32; 3]) -> Environment {
    let pixel = |index: u32| {
        let u = (f64::from(index % size[0]) + 0.5) / f64::from(size[0]);
        let v = (f64::from(index / size[0]) + 0.5) / f64::from(size[1]);
        let (sin_theta, cos_theta) = (std::f64::consts::PI * v).sin_cos();
        let (sin_phi, cos_phi) = (std::f64::consts::TAU * (0.5 - u)).sin_cos();
        radiance(DVec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi))
    };
    Environment {
        name: name.to_owned(),
        size,
        pixels: (0..size[0] * size[1]).map(pixel).collect(),
        scale: 1.0,
        rotation: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::double;

    #[test]
    fn the_middle_of_a_sky_is_at_plus_z_and_a_quarter_to_the_left_plus_x() {
        let sky = sky("axes", [64, 32], |direction| direction.as_vec3().to_array());
        let near = |x: usize, y: usize, axis: DVec3| {
            let pixel = double(sky.pixels[y * 64 + x]);
            assert!((pixel.length() - 1.0).abs() < 1e-6 && pixel.dot(axis) > 0.99, "{x} {y}: {pixel}");
        };
        near(32, 16, DVec3::Z);
        near(16, 16, DVec3::X);
        near(48, 16, DVec3::NEG_X);
        near(0, 16, DVec3::NEG_Z);
        near(7, 0, DVec3::Y);
        near(7, 31, DVec3::NEG_Y);
    }
}
