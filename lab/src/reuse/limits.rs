//! What limits reuse: what the last frame of a chain holds, and where its time goes.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::Vec2;
use restir_host::exec::{Executor, Step};
use restir_host::render::Render;
use restir_host::technique::restir_di::{DiSettings, Temporal};
use restir_host::{Error, buffers::SceneBuffers};
use restir_kernels::restir_di::{di_combine, di_exchange, di_gather, di_initial, di_offer, di_shade};
use restir_shared::camera::primary_ray;
use restir_shared::resample::similar::GBufferSurface;
use restir_shared::scene::Surface;
use restir_shared::technique::restir_di::{DiParams, PackedHit, PackedReservoir, Stored};
use restir_tests::random::SplitMix;

/// Pairs of neighbours whose rejection is looked at.
const PAIRS: u32 = 20_000;
/// Kernels whose time is of the initial candidates, of combining and of shading.
const STAGES: [&[&str]; 3] = [
    &[di_initial::DESC.name],
    &[di_combine::DESC.name],
    &[di_shade::DESC.name, di_offer::DESC.name, di_exchange::DESC.name, di_gather::DESC.name],
];

/// Shares of pixels, of pairs or of time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limits {
    /// Pixels of which no candidate of their own was of use, of those that see a surface.
    pub(super) empty: f64,
    /// Pixels that hold, before shading, the same sample as the pixel to the right or below.
    pub(super) copies: f64,
    /// Pixels with less than half of the confidence that the frames, or the cap, allow: their history is short.
    pub(super) young: f64,
    /// Neighbours within the radius of shading that are refused.
    pub(super) refused: f64,
    /// Time of initial candidates, of combining and of shading.
    pub(super) time: [f64; 3],
}

impl Limits {
    /// Of the last frame of a chain in a scene that stands still.
    pub(super) fn of(executor: &mut dyn Executor, scene: &SceneBuffers, chain: &Render) -> Result<Self, Error> {
        let settings = DiSettings::of(chain).cloned().unwrap_or_default();
        let mut limits = Self::default();
        let mut seconds: BTreeMap<&str, f64> = BTreeMap::new();
        let mut last = Instant::now();
        chain.render_observed(scene, executor, &mut |step| {
            *seconds.entry(step.pass.kernel.name).or_default() += last.elapsed().as_secs_f64();
            limits.look(scene, &settings, chain, step)?;
            last = Instant::now();
            Ok(())
        })?;
        let all: f64 = seconds.values().sum();
        let of_stage = |names: &[&str]| names.iter().filter_map(|name| seconds.get(name)).sum::<f64>() / all;
        limits.time = STAGES.map(of_stage);
        Ok(limits)
    }

    /// Takes what a pass of the last frame tells.
    fn look(
        &mut self,
        scene: &SceneBuffers,
        settings: &DiSettings,
        chain: &Render,
        step: &Step<'_>,
    ) -> Result<(), Error> {
        let Some(params) = step.pass.params::<DiParams>().filter(|params| params.frame + 1 == chain.count) else {
            return Ok(());
        };
        let name = step.pass.kernel.name;
        if name != di_initial::DESC.name && name != di_combine::DESC.name {
            return Ok(());
        }
        let hits: Vec<PackedHit> = step.plane("hits")?;
        let reservoirs: Vec<Stored> =
            step.plane::<PackedReservoir>("reservoirs")?.into_iter().map(Stored::unpack).collect();
        let sees: Vec<usize> = (0..hits.len()).filter(|&pixel| hits[pixel].unpack().is_hit()).collect();
        let share =
            |of: &dyn Fn(usize) -> bool| sees.iter().filter(|&&pixel| of(pixel)).count() as f64 / sees.len() as f64;
        if name == di_initial::DESC.name {
            self.empty = share(&|pixel| !reservoirs[pixel].has_sample());
            self.refused = refused(scene, &params, settings.shading_radius, &hits);
        }
        let width = chain.width as usize;
        let same =
            |a: usize, b: usize| reservoirs.get(b).is_some_and(|b| b.has_sample() && b.sample == reservoirs[a].sample);
        self.copies = share(&|pixel| same(pixel, pixel + 1) || same(pixel, pixel + width));
        let frames = if settings.temporal == Temporal::Off { 1 } else { chain.count };
        let half = 0.5 * settings.confidence_cap.min(frames) as f32;
        self.young = share(&|pixel| reservoirs[pixel].confidence < half);
        Ok(())
    }
}

/// The share of neighbours within a radius whose surfaces are too different.
fn refused(scene: &SceneBuffers, params: &DiParams, radius: f32, hits: &[PackedHit]) -> f64 {
    let mut random = SplitMix::new(1);
    let radius = f64::from(radius);
    let (mut asked, mut refused) = (0_u32, 0_u32);
    for _ in 0..PAIRS {
        let pixel = random.below(hits.len());
        let offset = [(); 2].map(|()| random.range(-radius, radius).round());
        let at = [pixel as u32 % params.width, pixel as u32 / params.width];
        let [x, y] = [0, 1].map(|axis| f64::from(at[axis]) + offset[axis]);
        let is_other = offset != [0.0; 2] && offset.iter().map(|o| o * o).sum::<f64>() <= radius * radius;
        let is_inside = x >= 0.0 && y >= 0.0 && x < f64::from(params.width) && y < f64::from(params.height);
        let Some(here) = surface(scene, params, at, hits).filter(|_| is_other && is_inside) else { continue };
        let there = surface(scene, params, [x as u32, y as u32], hits);
        asked += 1;
        refused += u32::from(!there.is_some_and(|there| params.similarity().holds(&here, &there)));
    }
    f64::from(refused) / f64::from(asked.max(1))
}

/// What decides on reuse at a pixel, if it sees anything.
fn surface(scene: &SceneBuffers, params: &DiParams, [x, y]: [u32; 2], hits: &[PackedHit]) -> Option<GBufferSurface> {
    let hit = hits[(y * params.width + x) as usize].unpack();
    let ray = primary_ray(&params.camera, Vec2::new(x as f32, y as f32) + 0.5, Vec2::ZERO);
    let point = hit.is_hit().then(|| scene.view().surface(&ray, &hit))?;
    Some(GBufferSurface { position: point.position, normal: point.normal, distance: hit.t })
}
