//! ReSTIR DI over a renderer's own scene, in no arena: a ball on a floor under a hundred lamps, first still, then rolling.
use restir_host::session::{CpuSession, Setup};
use restir_host::{Error, exec::CpuExecutor, foreign, scene::Camera, technique::restir_di::DiSettings};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{DVec3, UVec4, Vec2, Vec3};
use restir_shared::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, LightSample, Lights};
use restir_shared::scene::{Still, Surface, SurfacePoint, Trace};
use restir_shared::{bsdf::Material, layout::FEATURE_PUNCTUAL, num, rng, vec::dot};

const LAMPS: u32 = 100;
const RADIUS: f32 = 0.5;

struct Hall {
    ball: Vec3,
}
impl Trace for Hall {
    /// The coordinates of a hit are those of the floor, or height and longitude on the ball.
    fn closest(&self, ray: &Ray) -> Hit {
        let mut best = Hit { t: ray.t_max, ..Hit::MISS };
        let t = num::div(-ray.origin.y, ray.direction.y);
        let at = ray.origin + ray.direction * t;
        if t > 1e-4 && t < best.t {
            best = Hit { t, id: 0, uv: Vec2::new(at.x, at.z) };
        }
        let (from, a) = (ray.origin - self.ball, dot(ray.direction, ray.direction));
        let b = dot(from, ray.direction);
        let root = num::sqrt(num::max(b * b - a * (dot(from, from) - RADIUS * RADIUS), 0.0));
        let t = num::div(-b - root, a);
        let normal = (from + ray.direction * t) / RADIUS;
        if root > 0.0 && t > 1e-4 && t < best.t {
            best = Hit { t, id: 1, uv: Vec2::new(normal.y, num::atan2(normal.z, normal.x)) };
        }
        if best.id == Hit::MISS.id { Hit::MISS } else { best }
    }
}
impl Surface for Hall {
    type Material = Material;
    /// The point is where `id` and `uv` say: it is asked for again from elsewhere, and in other frames.
    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        if hit.id == 0 {
            return SurfacePoint::diffuse(Vec3::new(hit.uv.x, 0.0, hit.uv.y), Vec3::Y, 1e-3, Vec3::splat(0.6));
        }
        let (r, (sin, cos)) = (num::sqrt(num::max(1.0 - hit.uv.x * hit.uv.x, 0.0)), num::sin_cos(hit.uv.y));
        let normal = Vec3::new(r * cos, hit.uv.x, r * sin);
        SurfacePoint::diffuse(self.ball + normal * RADIUS, normal, 1e-3, Vec3::splat(0.8))
    }
    fn features(&self) -> u32 {
        FEATURE_PUNCTUAL
    }
}
impl Lights for Hall {
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.light_at(self.choose_address(words)).sample
    }
}
impl AddressedLights for Hall {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        LightAddress::of_words((rng::unit(words.z) * LAMPS as f32) as u32, words)
    }
    fn light_at(&self, LightAddress { light, .. }: LightAddress) -> AddressedLight {
        let position = Vec3::new((light % 10) as f32 - 4.5, 2.0, (light / 10) as f32 - 4.5);
        let (emission, density) = (Vec3::splat((light % 7) as f32), num::recip(LAMPS as f32));
        let sample = LightSample { position, emission, density, kind: LightKind::Point, ..LightSample::NONE };
        AddressedLight { sample, extent: 1.0 }
    }
}

fn main() -> Result<(), Error> {
    let camera = Camera::pinhole(DVec3::new(0.0, 2.0, 6.0), DVec3::Y * 0.5, DVec3::Y, 0.8);
    let hall = |x| Hall { ball: Vec3::new(x, RADIUS, 1.0) };
    foreign::check(&hall(0.0), &camera)?;
    let setup = Setup::foreign(FEATURE_PUNCTUAL, DiSettings::default(), [160, 120]);
    let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
    (0..8).try_for_each(|_| session.frame_over(&Still(hall(0.0)), camera, false).map(drop))?;
    (1..9).try_for_each(|i| session.frame_over(&[i, i - 1].map(|at| hall(at as f32 * 0.1)), camera, true).map(drop))?;
    let mean = session.pixels().iter().map(|pixel| pixel.sum[1]).sum::<f32>() / session.pixels().len() as f32;
    println!("mean radiance after a still and a moving half of 16 frames: {mean:.3}");
    Ok(())
}
