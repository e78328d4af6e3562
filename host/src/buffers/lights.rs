//! The lights of all kinds, chosen in proportion to their power; of the environment's, what scattering does not find as well.

use super::color::{fine_linear, linear, luminance};
use super::environment::EnvironmentMap;
use super::triangles::{Triangle, area};
use crate::scene::{Light, LightKind, Material, Scene, Texels, Texture, TextureUse, UvSet, Wrap};
use crate::{alias, bvh::Bounds};
use glam::DVec2;
use restir_shared::layout::{LIGHT_ENVIRONMENT, LIGHT_PUNCTUAL, LIGHT_TRIANGLE, SLOT_EMISSION};
use restir_shared::num::flush;

/// Points of a triangle at which the mean of its emission texture is taken, along each edge.
const TEXTURE_STEPS: u32 = 8;
/// Share of a textured emitter's power that does not depend on those points, which may miss what is bright.
const DEFENSIVE_SHARE: f64 = 0.05;

/// Records and, where lights differ in power, their alias table.
pub(super) struct LightTables {
    pub(super) lights: Vec<LightRecord>,
    pub(super) alias: Option<Vec<alias::Entry>>,
}

/// A light as [`restir_shared::layout`] has it, and its power over pi.
pub(super) struct LightRecord {
    /// Triangle, or index among the punctual lights.
    pub(super) index: u32,
    pub(super) density: f32,
    pub(super) kind: u32,
    /// Of a triangle; 1 of other lights.
    pub(super) area: f64,
    power: f64,
}

impl LightRecord {
    /// The density is that among all lights, which are not known yet.
    fn new(kind: u32, index: usize, power: f64, area: f64) -> Self {
        Self { index: index as u32, density: 0.0, kind, area, power }
    }
}

impl LightTables {
    /// `triangles` in the order of the arena; the environment is black if it is `None`.
    pub(super) fn new(
        scene: &Scene,
        triangles: &[Triangle],
        environment: Option<&EnvironmentMap>,
        bounds: &Bounds,
    ) -> Self {
        let radius = 0.5 * (bounds.hi.as_dvec3() - bounds.lo.as_dvec3()).length();
        let punctual = scene.lights.iter().map(|light| punctual_power(light, radius)).enumerate();
        let punctual = punctual.map(|(index, power)| LightRecord::new(LIGHT_PUNCTUAL, index, power, 1.0));
        let mut lights: Vec<LightRecord> =
            emissive(scene, triangles).chain(punctual).filter(|light| light.power > 0.0).collect();
        if let Some(environment) = environment {
            let power = environment_power(environment, radius, lights.iter().map(|light| light.power).sum());
            lights.push(LightRecord::new(LIGHT_ENVIRONMENT, 0, power, 1.0));
        }
        let powers: Vec<f64> = lights.iter().map(|light| light.power).collect();
        let alias = alias::build(&powers);
        for (light, probability) in lights.iter_mut().zip(alias::probabilities(powers.len(), alias.as_deref())) {
            light.density = flush((probability / light.area) as f32);
        }
        Self { lights, alias }
    }

    /// How many lights are of that kind.
    pub(super) fn count(&self, kind: u32) -> usize {
        self.lights.iter().filter(|light| light.kind == kind).count()
    }

    /// The probability with which the environment is chosen.
    pub(super) fn environment_probability(&self) -> f32 {
        self.lights.iter().find(|light| light.kind == LIGHT_ENVIRONMENT).map_or(0.0, |light| light.density)
    }
}

/// The triangles that may emit.
fn emissive(scene: &Scene, triangles: &[Triangle]) -> impl Iterator<Item = LightRecord> {
    let material = |triangle: Triangle| &scene.materials[triangle.material(scene)];
    let emitting = triangles.iter().copied().enumerate().filter(move |(_, triangle)| emits(material(*triangle)));
    emitting.map(move |(index, triangle)| {
        let material = material(triangle);
        let texture = material.textures()[SLOT_EMISSION as usize];
        let radiance = luminance(material.emission) * texture.map_or(1.0, |used| textured(scene, triangle, used));
        let sides = if material.two_sided_emission { 2.0 } else { 1.0 };
        let area = area(&triangle.vertices(scene));
        LightRecord::new(LIGHT_TRIANGLE, index, area * radiance * sides, area)
    })
}

/// The mean luminance of a texture over a triangle, about.
fn textured(scene: &Scene, triangle: Triangle, used: &TextureUse) -> f64 {
    let texture = &scene.textures[used.texture];
    let uvs = corner_uvs(scene, triangle, used.uv_set);
    let mut sum = 0.0;
    for i in 0..TEXTURE_STEPS {
        for j in 0..TEXTURE_STEPS - i {
            let step = |k: u32| (f64::from(k) + 1.0 / 3.0) / f64::from(TEXTURE_STEPS);
            let uv = uvs[0] + (uvs[1] - uvs[0]) * step(i) + (uvs[2] - uvs[0]) * step(j);
            sum += nearest_luminance(texture, used, uv);
        }
    }
    let points = f64::from(TEXTURE_STEPS * (TEXTURE_STEPS + 1) / 2);
    let brightest = match &texture.texels {
        Texels::Eight(texels) => texels.iter().map(coarse_luminance).fold(0.0, f64::max),
        Texels::Sixteen(texels) => texels.iter().map(fine_luminance).fold(0.0, f64::max),
    };
    sum / points * (1.0 - DEFENSIVE_SHARE) + brightest * DEFENSIVE_SHARE
}

fn coarse_luminance(&[r, g, b, _]: &[u8; 4]) -> f64 {
    luminance([r, g, b].map(|code| linear(code) as f32))
}

fn fine_luminance(&[r, g, b, _]: &[u16; 4]) -> f64 {
    luminance([r, g, b].map(|code| fine_linear(code) as f32))
}

fn nearest_luminance(texture: &Texture, used: &TextureUse, uv: DVec2) -> f64 {
    let m = used.transform.map(f64::from);
    let at = [m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]];
    let texel = |axis: usize| {
        let size = f64::from(texture.size[axis]);
        let inside = match texture.wrap[axis] {
            Wrap::Repeat => at[axis].rem_euclid(1.0),
            Wrap::Mirror => 1.0 - (at[axis].rem_euclid(2.0) - 1.0).abs(),
            Wrap::Clamp => at[axis].clamp(0.0, 1.0),
        };
        (inside * size).min(size - 1.0) as usize
    };
    let at = texel(1) * texture.size[0] as usize + texel(0);
    match &texture.texels {
        Texels::Eight(texels) => coarse_luminance(&texels[at]),
        Texels::Sixteen(texels) => fine_luminance(&texels[at]),
    }
}

/// The texture coordinates of a triangle's corners, in the order of its vertices; zero without.
pub(super) fn corner_uvs(scene: &Scene, triangle: Triangle, set: UvSet) -> [DVec2; 3] {
    let mesh = triangle.mesh(scene);
    let uvs = if set == UvSet::First { &mesh.uvs } else { &mesh.second_uvs };
    triangle.corners(scene).map(|i| uvs.get(i).map_or(DVec2::ZERO, |&[u, v]| DVec2::new(f64::from(u), f64::from(v))))
}

/// Power over pi, as of surfaces of area A and radiance L, which have L A.
fn punctual_power(light: &Light, radius: f64) -> f64 {
    let intensity = luminance(light.intensity);
    match light.kind {
        LightKind::Point { .. } => 4.0 * intensity,
        LightKind::Spot { outer, .. } => 2.0 * (1.0 - outer.cos()) * intensity,
        LightKind::Directional { .. } => radius * radius * intensity,
    }
}

/// The environment's power is as that of other lights, but at most their sum: how much of the environment a scene catches goes with its size, which says nothing of what
/// reaches a point. So at least half of the samples are left to the others.
fn environment_power(environment: &EnvironmentMap, radius: f64, others: f64) -> f64 {
    let power = environment.integral * radius * radius;
    if others > 0.0 { power.min(others) } else { power }
}

/// Whether a material emits.
pub(super) fn emits(material: &Material) -> bool {
    luminance(material.emission) > 0.0
}
