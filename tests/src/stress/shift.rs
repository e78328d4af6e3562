//! Shifts of paths ([`restir_shared::shift`]) over one segment, from almost no length to a million units and along the surfaces at its ends,
//! and the weights of light that scattering finds.

use super::{Axis, Expected, Function, ROUNDINGS, Row, SMALLEST, TOLERANCE};
use crate::shift_f64::{Corner, Leg};
use glam::{DVec3, UVec4, Vec2, Vec3};
use restir_shared::bsdf::{COS_MIN, Material, SPECULAR_REFLECTION};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::layout::{FEATURE_VOLUME, FEATURES_ALL};
use restir_shared::num::UNIT_ROUNDOFF;
use restir_shared::scene::{
    AddressedLight, AddressedLights, LightAddress, LightSample, Lights, Surface, SurfacePoint, Trace,
};
use restir_shared::shift::{Cause, End, Hybrid, Numbers, Path, PathOrigin, shift};
use restir_shared::transport::{Chosen, Vertex, emission_weight, environment_weight};

const DISTANCE: (&str, Axis) = ("distance", Axis::Log(1.0e-6, 1.0e6));
/// Cosines below [`COS_MIN`] count as zero, so those that a rounding takes there have no value to compare.
const COS_FROM: (&str, Axis) = ("cos at the start", Axis::Log(8.0 * COS_MIN, 1.0));
const COS_TO: (&str, Axis) = ("cos at the joint", Axis::Log(8.0 * COS_MIN, 1.0));
const ROUGHNESS: (&str, Axis) = ("roughness", Axis::Log(0.0101, 1.0));
/// The diffuse lobe of a plastic, and the specular one of a metal.
const LOBE: (&str, Axis) = ("lobe", Axis::Set(&[0.0, 1.0]));
/// How far off its surface a segment begins: not at all, or by what a coordinate of one unit asks for.
const OFFSET: (&str, Axis) = ("offset", Axis::Set(&[0.0, 3.8e-6]));
const DENSITY: (&str, Axis) = ("density of the light", Axis::ZeroLog(1.0e-12, 1.0e12));
const PDF: (&str, Axis) = ("density of scattering", Axis::Log(1.0e-12, 1.0e12));
const PDF_OR_NONE: (&str, Axis) = ("density of scattering", Axis::ZeroLog(1.0e-12, 1.0e12));
const COS: (&str, Axis) = ("cos", Axis::ZeroLog(1.0e-6, 1.0));
/// Thresholds by roughness and distance, and by footprint.
const CRITERION: (&str, Axis) = ("criterion", Axis::Set(&[0.0, 1.0]));
const LEAST_ROUGHNESS: (&str, Axis) = ("least roughness", Axis::Set(&[0.0, 0.0099, 0.199_99, 0.2, 1.0]));

pub(super) fn rows() -> Vec<Row> {
    vec![
        Function::new("shift, one segment", &[DISTANCE, COS_FROM, COS_TO, ROUGHNESS, LOBE, OFFSET], shifted)
            .against(exactly_shifted),
        Function::new("Joins::surfaces", &[CRITERION, DISTANCE, COS_FROM, COS_TO, PDF_OR_NONE, LEAST_ROUGHNESS], joins)
            .against(exactly_joins),
        Function::new("emission_weight", &[DENSITY, DISTANCE, COS, PDF_OR_NONE], |p| {
            let point = SurfacePoint::diffuse(Vec3::ZERO, Vec3::new(0.0, 0.0, -p[2]), 0.0, Vec3::ONE);
            [emission_weight(p[0], &point, &along_z(), p[1], Chosen { pdf: p[3], alone: false })]
        })
        .against(|p| {
            let (light, scattering) = (p[0] * p[1] * p[1], p[3] * p[2]);
            [Expected::relative(if scattering > 0.0 { scattering / (scattering + light) } else { 0.0 })]
        }),
        Function::new("environment_weight", &[DENSITY, PDF], |p| {
            [environment_weight(p[0], Chosen { pdf: p[1], alone: false })]
        })
        .against(|p| [Expected::relative(p[1] / (p[1] + p[0]))]),
    ]
}

fn along_z() -> Ray {
    Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR, key: 0 }
}

/// Two points of surfaces with nothing in between: a start, and where a path is joined to it.
#[derive(Clone, Copy)]
struct Two {
    points: [SurfacePoint; 2],
}

impl Two {
    /// The segment lies along the z axis; the start is seen along its normal, and the path leaves the joint along the normal there.
    fn new(p: &[f32]) -> Self {
        let tilted = |cos: f32| Vec3::new((1.0 - f64::from(cos).powi(2)).max(0.0).sqrt() as f32, 0.0, cos);
        let material = match p[4] as u32 {
            0 => Material { ior: 1.5, roughness: p[3], ..Material::diffuse(Vec3::splat(0.5)) },
            _ => Material { metallic: 1.0, roughness: p[3], ..Material::diffuse(Vec3::splat(0.5)) },
        };
        let point =
            |position, normal| SurfacePoint { material, ..SurfacePoint::diffuse(position, normal, p[5], Vec3::ONE) };
        let to = tilted(p[2]);
        Self { points: [point(Vec3::ZERO, tilted(p[1])), point(Vec3::Z * p[0], Vec3::new(0.0, to.x, -to.z))] }
    }

    fn ray(&self) -> Ray {
        Ray { direction: -self.points[0].normal, ..along_z() }
    }

    fn path(lobe: u32, direction: Vec3) -> Path {
        let hit = Hit { t: 1.0, id: 1, uv: Vec2::ZERO };
        Path {
            length: 4,
            reconnection: 2,
            lobes: [lobe; 2],
            hit,
            direction,
            radiance: Vec3::ONE,
            term: 1.0,
            ..Path::NONE
        }
    }
}

impl Trace for Two {
    fn closest(&self, _: &Ray) -> Hit {
        Hit::MISS
    }
}

impl Surface for Two {
    type Material = Material;

    fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
        self.points[hit.id as usize]
    }

    fn features(&self) -> u32 {
        FEATURES_ALL & !FEATURE_VOLUME
    }
}

impl Lights for Two {
    fn sample_light(&self, _: UVec4) -> LightSample {
        LightSample::NONE
    }
}

impl AddressedLights for Two {
    fn choose_address(&self, _: UVec4) -> LightAddress {
        LightAddress::NONE
    }

    fn light_at(&self, _: LightAddress) -> AddressedLight {
        AddressedLight::NONE
    }
}

/// Nothing is replayed.
struct Unneeded;

impl Numbers for Unneeded {
    fn scatter(&self, _: u32) -> UVec4 {
        UVec4::ZERO
    }

    fn joins(&self) -> UVec4 {
        UVec4::splat(0x8000_8000)
    }
}

fn lobe(p: f64) -> u32 {
    if p == 0.0 { 0 } else { SPECULAR_REFLECTION }
}

/// The term and the integrand.
fn shifted(p: &[f32]) -> [f32; 2] {
    let two = Two::new(p);
    let start = PathOrigin::new(&two.ray(), &Hit { t: 1.0, id: 0, uv: Vec2::ZERO });
    let path = Two::path(lobe(f64::from(p[4])), two.points[1].normal);
    let shifted = shift(&two, &Unneeded, &Hybrid::RECONNECTION, &start, &path, false);
    // beyond the range there is no path, and that is said
    let said = (shifted.term > 0.0) == (shifted.cause == Cause::Nothing);
    if said { [shifted.term, shifted.value.x] } else { [f32::NAN; 2] }
}

/// What the formulas say. Directions are known to a rounding or two of each component, of which the cosines at both ends have their error,
/// and of smooth lobes the densities.
fn exactly_shifted(p: &[f64]) -> [Expected; 2] {
    let narrow: Vec<f32> = p.iter().map(|x| *x as f32).collect();
    let two = Two::new(&narrow);
    let see = |point: &SurfacePoint, direction: Vec3| {
        let ray = Ray { direction, ..along_z() };
        let bsdf = Vertex::new(point, &ray, two.features()).bsdf;
        Corner::new(point).seen(direction.as_dvec3().normalize(), &bsdf, two.features())
    };
    let [from, to] = &two.points;
    let lobe = lobe(p[4]);
    let start = see(from, two.ray().direction);
    let leg = Leg::new(&start, to.position.as_dvec3());
    let joint = see(to, leg.direction.as_vec3());
    let away = to.normal.as_dvec3().normalize();
    let normal: DVec3 = to.normal.as_dvec3();
    let term = start.pdf(lobe, leg.direction) * leg.per_area(normal) * joint.pdf(lobe, away);
    let factor = |seen: &crate::shift_f64::Seen, direction| seen.value(direction).x / seen.pdf_of_all(direction);
    let value = factor(&start, leg.direction) * factor(&joint, away);
    let cosines = start.cos(leg.direction).recip() + normal.dot(leg.direction).abs().recip();
    let smooth = (p[3] * p[3]).recip();
    let error = DIRECTION * (cosines + smooth) / TOLERANCE;
    let exists = term > SMALLEST && term < LARGEST && value > SMALLEST;
    [term, value].map(|x| if exists { Expected::against(x, x * (1.0 + error)) } else { Expected::against(0.0, 1.0) })
}

/// The error of a component of a direction, in the cosine, the masking and the density that go with it, of the integrand and of what it is
/// divided by.
const DIRECTION: f64 = 6.0 * ROUNDINGS * UNIT_ROUNDOFF as f64;
/// Terms beyond are no path's.
const LARGEST: f64 = 1.0e30;

/// Whether a segment is joined, both of whose ends have the same density and roughness.
fn joins(p: &[f32]) -> [f32; 1] {
    let hybrid = if p[0] == 0.0 { Hybrid::new(0.2, 0.1) } else { Hybrid::by_footprint(0.02, 0.1) };
    let joins = hybrid.of_path(Unneeded.joins()).at_origin(1.0, 1.0);
    let end = |cos| End { roughness: p[5], pdf: p[4], cos };
    [f32::from(u8::from(joins.surfaces(&end(p[2]), &end(p[3]), p[1] * p[1])))]
}

fn exactly_joins(p: &[f64]) -> [Expected; 1] {
    let [t, from, to, pdf, roughness] = [p[1], p[2], p[3], p[4], p[5]];
    // each is over its threshold where the ratio is above one
    let footprint = 4.0 * std::f64::consts::PI * 0.02_f64.powi(2);
    let ratios = if p[0] == 0.0 {
        [t / 0.1, f64::INFINITY, f64::INFINITY]
    } else {
        [t * t / (footprint * pdf * to), t * t / (footprint * pdf * from), 100.0 / pdf]
    };
    let rough = roughness > 0.0 && (p[0] != 0.0 || roughness >= f64::from(0.2_f32));
    let joined = rough && ratios.iter().all(|ratio| *ratio > 1.0);
    // at a threshold roundings decide
    let at_threshold = ratios.iter().any(|ratio| (ratio - 1.0).abs() < 1.0e-5);
    [Expected::against(f64::from(u8::from(joined)), if at_threshold { f64::INFINITY } else { 1.0 })]
}
