//! The scene: what a renderer knows of its own world, as answers to five traits.
//!
//! It lies in a buffer. A zero in the source would be a constant of the shader, and a driver takes `x * 0` for 0 without regard to the sign.

use bytemuck::{Pod, Zeroable};
use restir_shared::bsdf::Material;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::layout::{FEATURE_EMISSIVE, FEATURE_GLOSSY};
use restir_shared::num::{abs, div, sqrt};
use restir_shared::scene::{AddressedLight, AddressedLights, Frames, LightAddress, LightKind, LightSample, Lights};
use restir_shared::scene::{Surface, SurfacePoint, Trace};
use restir_shared::vec::{dot, normalize};

/// Something that rays hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Thing {
    /// The centre of a sphere or a lamp, or a point of the floor.
    pub centre: [f32; 3],
    /// The radius of a sphere, or half of the side of a lamp.
    pub size: f32,
    /// The normal of the floor and of lamps, which is ±y.
    pub normal: [f32; 3],
    /// See [`Material::roughness`].
    pub roughness: f32,
    /// See [`Material::base_color`].
    pub color: [f32; 3],
    /// See [`Material::metallic`].
    pub metallic: f32,
    /// Radiance of a lamp.
    pub emission: [f32; 3],
    /// How often the lamp is chosen: these add up to 1.
    pub chosen: f32,
    /// See [`Material::transmission`].
    pub transmission: f32,
    /// See [`Material::ior`].
    pub ior: f32,
    /// Zeros.
    pub reserved: [f32; 2],
}

/// What the numbers of hits mean: the floor is 0, then come three spheres, of which the last rolls, and two square lamps.
const FIRST_SPHERE: u32 = 1;
const ROLLS: u32 = 3;
const FIRST_LAMP: u32 = 4;
const THINGS: u32 = 6;
/// Rays begin so far off surfaces.
const OFFSET: f32 = 1.0e-3;

/// Three spheres on an endless floor under two lamps that shine downwards. Nothing of it is a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Spheres<'a> {
    /// The floor, the spheres, the lamps.
    pub things: &'a [Thing],
    /// How far the last sphere has rolled, in units of the scene.
    pub rolled: f32,
}

/// The scene in two frames.
#[derive(Clone, Copy, Debug)]
pub struct Moving<'a> {
    /// As [`Spheres::things`].
    pub things: &'a [Thing],
    /// The two frames.
    pub frames: (u32, u32),
}

impl<'a> Spheres<'a> {
    /// The scene in a frame.
    pub fn of_frame(things: &'a [Thing], frame: u32) -> Self {
        Self { things, rolled: 0.03 * frame as f32 }
    }

    fn thing(&self, id: u32) -> Thing {
        self.things[id as usize]
    }

    fn centre(&self, id: u32) -> Vec3 {
        let mut centre = Vec3::from_array(self.thing(id).centre);
        if id == ROLLS {
            centre.x -= self.rolled;
        }
        centre
    }

    /// Where a ray meets the plane of the floor or of a lamp; behind its origin, if it does not.
    fn plane(&self, ray: &Ray, id: u32) -> (f32, Vec2) {
        let centre = self.centre(id);
        let t = if ray.direction.y == 0.0 { -1.0 } else { div(centre.y - ray.origin.y, ray.direction.y) };
        let at = ray.origin + ray.direction * t;
        let off = Vec2::new(at.x - centre.x, at.z - centre.z);
        let size = self.thing(id).size;
        let within = id < FIRST_SPHERE || (abs(off.x) < size && abs(off.y) < size);
        (if within { t } else { -1.0 }, Vec2::new(at.x, at.z))
    }

    /// Where a ray meets a sphere first, from outside.
    fn ball(&self, ray: &Ray, id: u32) -> (f32, Vec2) {
        let to = ray.origin - self.centre(id);
        let radius = self.thing(id).size;
        let (a, b) = (dot(ray.direction, ray.direction), dot(to, ray.direction));
        let inside = b * b - a * (dot(to, to) - radius * radius);
        let t = if inside > 0.0 { div(-b - sqrt(inside), a) } else { -1.0 };
        (t, unfold(normalize(to + ray.direction * t)))
    }
}

/// A unit vector as a point of [-1, 1]², by an octahedron that is unfolded.
fn unfold(n: Vec3) -> Vec2 {
    let scale = div(1.0, abs(n.x) + abs(n.y) + abs(n.z));
    let (x, z) = (n.x * scale, n.z * scale);
    if n.y < 0.0 { Vec2::new(folded(z, x), folded(x, z)) } else { Vec2::new(x, z) }
}

fn fold(uv: Vec2) -> Vec3 {
    let y = 1.0 - abs(uv.x) - abs(uv.y);
    let (x, z) = if y < 0.0 { (folded(uv.y, uv.x), folded(uv.x, uv.y)) } else { (uv.x, uv.y) };
    normalize(Vec3::new(x, y, z))
}

/// 1 - |a| with the sign of b.
fn folded(a: f32, b: f32) -> f32 {
    let rest = 1.0 - abs(a);
    if b < 0.0 { -rest } else { rest }
}

fn is_sphere(id: u32) -> bool {
    (FIRST_SPHERE..FIRST_LAMP).contains(&id)
}

fn is_lamp(hit: &Hit) -> bool {
    hit.is_hit() && hit.id >= FIRST_LAMP
}

impl Trace for Spheres<'_> {
    fn closest(&self, ray: &Ray) -> Hit {
        let mut nearest = Hit { t: ray.t_max, ..Hit::MISS };
        let mut id = 0;
        while id < THINGS {
            let (t, uv) = if is_sphere(id) { self.ball(ray, id) } else { self.plane(ray, id) };
            if t > 0.0 && t < nearest.t {
                nearest = Hit { t, id, uv };
            }
            id += 1;
        }
        nearest
    }
}

impl Surface for Spheres<'_> {
    type Material = Material;

    /// The point follows from `id` and `uv` alone, for reuse asks for it again from other pixels.
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let (thing, centre) = (self.thing(hit.id), self.centre(hit.id));
        let mut normal = Vec3::from_array(thing.normal);
        let mut position = Vec3::new(hit.uv.x, centre.y, hit.uv.y);
        if is_sphere(hit.id) {
            normal = fold(hit.uv);
            position = centre + normal * thing.size;
        }
        let mut point = SurfacePoint::diffuse(position, normal, OFFSET, Vec3::from_array(thing.color));
        point.material.metallic = thing.metallic;
        point.material.roughness = thing.roughness;
        point.material.transmission = thing.transmission;
        point.material.ior = thing.ior;
        // what is seen from below shines, as `light_at` says
        if is_lamp(hit) && ray.direction.y > 0.0 {
            point.emission = Vec3::from_array(thing.emission);
        }
        point
    }

    fn features(&self) -> u32 {
        FEATURE_EMISSIVE | FEATURE_GLOSSY
    }
}

impl Lights for Spheres<'_> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.light_at(self.choose_address(words)).sample
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        if !is_lamp(hit) {
            return 0.0;
        }
        let thing = self.thing(hit.id);
        div(thing.chosen, 4.0 * thing.size * thing.size)
    }
}

impl AddressedLights for Spheres<'_> {
    /// The first two words make the point, the third chooses the lamp.
    fn choose_address(&self, words: UVec4) -> LightAddress {
        let first = self.thing(FIRST_LAMP).chosen;
        LightAddress::of_words(if restir_shared::rng::unit(words.z) < first { 0 } else { 1 }, words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let id = FIRST_LAMP + address.light;
        let (thing, centre) = (self.thing(id), self.centre(id));
        let off = (address.uv() * 2.0 - 1.0) * thing.size;
        let extent = 4.0 * thing.size * thing.size;
        let sample = LightSample {
            position: Vec3::new(centre.x + off.x, centre.y, centre.z + off.y),
            normal: Vec3::from_array(thing.normal),
            emission: Vec3::from_array(thing.emission),
            density: div(thing.chosen, extent),
            kind: LightKind::Area,
            offset: OFFSET,
            ..LightSample::NONE
        };
        AddressedLight { sample, extent }
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        if !is_lamp(hit) {
            return LightAddress::NONE;
        }
        let (centre, size) = (self.centre(hit.id), self.thing(hit.id).size);
        let off = hit.uv - Vec2::new(centre.x, centre.z);
        LightAddress::nearest(hit.id - FIRST_LAMP, off * div(0.5, size) + 0.5)
    }
}

impl<'a> Frames for Moving<'a> {
    type Scene = Spheres<'a>;

    fn scene(&self, other: bool) -> Spheres<'a> {
        Spheres::of_frame(self.things, if other { self.frames.1 } else { self.frames.0 })
    }

    /// No lamp appears or goes out.
    fn counterpart(&self, address: LightAddress, _: bool) -> LightAddress {
        address
    }
}
