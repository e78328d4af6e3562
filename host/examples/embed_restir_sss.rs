//! ReSTIR SSS over a renderer's own scene, in no arena: a ball of wax between lamps, first still, then rolling. Beside what ReSTIR DI asks,
//! a scene says what its bodies hold (`interior`), which points belong together (`object`), and where a segment crosses a body (`probe`).
use restir_host::session::{CpuSession, Setup};
use restir_host::{Error, exec::CpuExecutor, foreign, scene::Camera, technique::restir_sss::SssSettings};
use restir_shared::geometry::{Crossings, Hit, Ray};
use restir_shared::glam::{DVec3, UVec4, Vec2, Vec3};
use restir_shared::layout::{FEATURE_DIFFUSE_TRANSMISSION, FEATURE_PUNCTUAL, FEATURE_SUBSURFACE};
use restir_shared::scene::{AddressedLight, AddressedLights, AnyFrames, AnyProbed, AnyScene, LightAddress, LightKind};
use restir_shared::scene::{LightSample, Lights, Probe, Surface, SurfacePoint, Trace};
use restir_shared::{bsdf::Material, medium::Interior, num, rng, vec::dot};

const FEATURES: u32 = FEATURE_PUNCTUAL | FEATURE_DIFFUSE_TRANSMISSION | FEATURE_SUBSURFACE;
const LAMPS: u32 = 6;
/// A ball of radius 1, with its centre on the x axis.
struct Wax(f32);
impl Wax {
    /// Where a ray's line meets the ball, from the front on. The coordinates of a hit are height and longitude.
    fn hits(&self, ray: &Ray) -> [Hit; 2] {
        let (from, a) = (ray.origin - Vec3::X * self.0, dot(ray.direction, ray.direction));
        let b = dot(from, ray.direction);
        let root = num::sqrt(num::max(b * b - a * (dot(from, from) - 1.0), 0.0));
        [-root, root].map(|root| {
            let t = num::div(root - b, a);
            let normal = from + ray.direction * t;
            let hit = Hit { t, id: 0, uv: Vec2::new(normal.y, num::atan2(normal.z, normal.x)) };
            if root != 0.0 && t > 1e-4 && t < ray.t_max { hit } else { Hit::MISS }
        })
    }
}
impl Trace for Wax {
    fn closest(&self, ray: &Ray) -> Hit {
        self.probe(ray, 0).nearest[0]
    }
}
impl Probe for Wax {
    fn object(&self, _: &Hit) -> u32 {
        0
    }
    fn probe(&self, ray: &Ray, _: u32) -> Crossings {
        self.hits(ray).into_iter().filter(Hit::is_hit).fold(Crossings::NONE, Crossings::with)
    }
}
impl Surface for Wax {
    type Material = Material;
    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        let (r, (sin, cos)) = (num::sqrt(num::max(1.0 - hit.uv.x * hit.uv.x, 0.0)), num::sin_cos(hit.uv.y));
        let normal = Vec3::new(r * cos, hit.uv.x, r * sin);
        let mut point = SurfacePoint::diffuse(Vec3::X * self.0 + normal, normal, 1e-3, Vec3::ZERO);
        // all light goes in, spread by Lambert's law
        (point.material.diffuse_transmission, point.material.diffuse_transmission_color) = (1.0, Vec3::ONE);
        point
    }
    fn interior(&self, _: &Hit) -> Interior {
        let (extinction, albedo) = (Vec3::new(10.0, 20.0, 40.0), Vec3::new(0.99, 0.97, 0.9));
        Interior { closed: true, filled: true, body: 0, extinction, albedo, offset: 1e-3, ..Interior::NONE }
    }
}
impl Lights for Wax {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.light_at(self.choose_address(words)).sample
    }
}
impl AddressedLights for Wax {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        LightAddress::of_words((rng::unit(words.z) * LAMPS as f32) as u32, words)
    }
    fn light_at(&self, LightAddress { light, .. }: LightAddress) -> AddressedLight {
        let (sin, cos) = num::sin_cos(num::div(light as f32, LAMPS as f32));
        let (position, density) = (Vec3::new(3.0 * cos, 2.0, 3.0 * sin), num::recip(LAMPS as f32));
        let lamp = LightSample { position, density, kind: LightKind::Point, ..LightSample::NONE };
        AddressedLight { sample: LightSample { emission: Vec3::splat(8.0), ..lamp }, extent: 1.0 }
    }
}
/// The scene in this frame and in the last one.
struct Frames([Wax; 2]);
impl AnyFrames for Frames {
    fn scene(&self, other: bool) -> &dyn AnyScene {
        &self.0[usize::from(other)]
    }
    fn probed(&self, other: bool) -> Option<&dyn AnyProbed> {
        Some(&self.0[usize::from(other)])
    }
    fn counterpart(&self, address: LightAddress, _: bool) -> LightAddress {
        address
    }
}

fn main() -> Result<(), Error> {
    let camera = Camera::pinhole(DVec3::new(0.0, 1.0, 5.0), DVec3::ZERO, DVec3::Y, 0.6);
    foreign::check(&Wax(0.0), &camera)?;
    let setup = Setup::foreign(FEATURES, SssSettings::default(), [160, 120]);
    let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
    for frame in 0..16_u32 {
        let at = |frame: u32| Wax(0.05 * frame.saturating_sub(8) as f32);
        session.frame_over(&Frames([at(frame), at(frame.saturating_sub(1))]), camera, frame > 8)?;
    }
    let mean = session.pixels().iter().map(|pixel| pixel.sum[0]).sum::<f32>() / session.pixels().len() as f32;
    println!("mean radiance of red after a still and a moving half of 16 frames: {mean:.3}");
    Ok(())
}
