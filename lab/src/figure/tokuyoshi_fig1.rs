//! Tokuyoshi, supplement, figure 1: an image with the visibility of the selected sample and with the averaged one, what
//! either takes for visible, and the image without visibility.

use std::fmt::Write;

use crate::bootstrap::{Interval, mean};
use restir::exec::{CpuExecutor, Executor, Step};
use restir::render::{Progress, Render};
use restir::{Error, buffers::SceneBuffers, image::Image, scene::Scene, technique::restir_di::DiSettings};
use restir_kernels::restir_di::di_shade;
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::restir_di::{DiParams, Stored, shade};

use super::averaging::{METHODS, settings};
use super::claim::{self, Claim};
use super::picture::{grey, grid};
use super::{Environs, Files, PICTURE, chains::Protocol, cost::Cost};
use crate::bench::table::Setup;

const SCENE: &str = "many-lights";
const RESAMPLES: u32 = 1000;
/// What is resampled: squares of so many pixels a side, because neighbours share samples.
const TILE: u32 = 8;
/// By how much the specification asks the variance to fall.
const REDUCTION: f64 = 1.5;
/// Where the ratio of variances is white in its map.
const WHITE_RATIO: f64 = 4.0;

/// Whether a reservoir has a weight. Where it has none, nothing is multiplied by its visibility.
fn weighs(reservoir: &Stored) -> bool {
    reservoir.contribution_weight > 0.0
}

/// What a reservoir takes for visible; nothing without a weight.
fn visibility(reservoir: &Stored) -> f64 {
    if weighs(reservoir) { reservoir.visibility.x.into() } else { 0.0 }
}

/// What a method made of a chain of frames.
#[derive(Default)]
struct Chain {
    /// The reservoirs of every frame, one after the other, without their visibility.
    samples: Vec<Stored>,
    /// Of each pixel over the frames that count.
    visibility: Vec<Moments>,
    /// Of the last frame: as shaded, its visibility, and as shaded without.
    last: [Image; 3],
}

/// Sums of a number, and of its square.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn push(&mut self, x: f64) {
        *self = self.plus(Self { count: 1.0, sum: x, squares: x * x });
    }

    fn plus(self, other: Self) -> Self {
        Self { count: self.count + other.count, sum: self.sum + other.sum, squares: self.squares + other.squares }
    }

    /// Whether there are enough numbers for a variance.
    fn is_known(&self) -> bool {
        self.count >= 2.0
    }

    fn mean(self) -> f64 {
        self.sum / self.count
    }

    fn variance(self) -> f64 {
        (self.squares - self.sum * self.sum / self.count) / (self.count - 1.0)
    }
}

/// Sums over the pixels of a tile, by method.
#[derive(Clone, Copy, Default)]
struct Tile {
    pixels: f64,
    variances: [f64; 2],
    means: [f64; 2],
}

/// What was found.
#[derive(Default)]
struct Findings {
    size: [u32; 2],
    /// Moments of visibility of each pixel, by method.
    moments: [Vec<Moments>; 2],
    /// The last frame of the first chain, by method.
    last: [[Image; 3]; 2],
    /// Reservoirs that differ in sample, weight or confidence, of all.
    differing: [u64; 2],
    shadow_rays: f64,
}

/// The files of the figure. The first `warm_up` frames of a chain do not count, and `protocol.warm_up` after them do.
///
/// # Errors
/// As of [`Render::check`]; [`Error::Interrupted`].
pub(crate) fn make(
    environs: &mut impl Environs,
    protocol: Protocol,
    counted: u32,
    setup: &Setup,
) -> Result<Files, Error> {
    let scene = SceneBuffers::build(&Scene::load(SCENE)?)?;
    let settings = settings(protocol.size[1]);
    let render = |seed: u32, settings: &DiSettings| Render {
        count: protocol.warm_up + counted,
        // every frame is shaded
        accumulate: true,
        seed,
        ..Render::new(protocol.size, settings.clone())
    };
    settings.iter().try_for_each(|settings| render(0, settings).check(&scene))?;
    let total = u64::from(protocol.chains);
    let mut findings = Findings::default();
    environs.run(SCENE, |_, observe| {
        (0..protocol.chains).try_for_each(|seed| {
            let chain = |settings| chain(&scene, &render(seed, settings), protocol.warm_up);
            let (prev, ours) = rayon::join(|| chain(&settings[0]), || chain(&settings[1]));
            findings.add([prev?, ours?]);
            let done = u64::from(seed) + 1;
            observe(Progress { done, total })
        })
    })?;
    let findings = Findings {
        size: protocol.size,
        shadow_rays: Cost::of(&scene, protocol.size, &settings[1])?.shadow_rays,
        ..findings
    };
    Ok(Files {
        picture: Some(findings.picture()),
        texts: vec![("tiles.csv".to_owned(), findings.table())],
        report: findings.report(protocol, counted, &settings[1], setup),
    })
}

/// Runs a chain natively. Frames from `first` on count.
fn chain(scene: &SceneBuffers, render: &Render, first: u32) -> Result<Chain, Error> {
    let (view, size) = (scene.view(), [render.width, render.height]);
    let mut chain = Chain::default();
    chain.visibility.resize((render.width * render.height) as usize, Moments::default());
    let mut shaded = |step: &Step<'_>| -> Result<(), Error> {
        let p: DiParams = bytemuck::pod_read_unaligned(bytemuck::cast_slice(&step.pass.params));
        let reservoirs: Vec<Stored> = step.plane("reservoirs")?.into_iter().map(Stored::unpack).collect();
        let with = |visibility, reservoir: &Stored| Stored { visibility, ..*reservoir };
        chain.samples.extend(reservoirs.iter().map(|reservoir| with(Vec3::ZERO, reservoir)));
        if p.frame >= first {
            let pixels = chain.visibility.iter_mut().zip(&reservoirs).filter(|(_, reservoir)| weighs(reservoir));
            pixels.for_each(|(moments, reservoir)| moments.push(reservoir.visibility.x.into()));
        }
        if p.frame + 1 == render.count {
            let [direct, film]: [Vec<FilmPixel>; 2] = [step.plane("direct")?, step.plane("film")?];
            let hits = step.plane("hits")?;
            let unseen = |i: usize| {
                let at = [i as u32 % render.width, i as u32 / render.width];
                shade(view, &p, hits[i], with(Vec3::ONE, &reservoirs[i]).pack(), direct[i], at).sum
            };
            let image = |pixels| Image { width: render.width, height: render.height, pixels };
            chain.last = [
                image(film.iter().map(|pixel| pixel.sum).collect()),
                grey(size, reservoirs.iter().map(visibility)),
                image((0..hits.len()).map(unseen).collect()),
            ];
        }
        Ok(())
    };
    CpuExecutor::inline().run_observed(render.plan(scene), &mut |step| {
        if step.pass.kernel.name == di_shade::DESC.name { shaded(step) } else { Ok(()) }
    })?;
    Ok(chain)
}

impl Findings {
    /// Adds one more chain of either method.
    fn add(&mut self, chains: [Chain; 2]) {
        let [prev, ours] = chains.each_ref().map(|chain| &chain.samples);
        self.differing[0] += prev.iter().zip(ours).filter(|(a, b)| a != b).count() as u64;
        self.differing[1] += prev.len() as u64;
        let is_first = self.moments[0].is_empty();
        for ((moments, last), chain) in self.moments.iter_mut().zip(&mut self.last).zip(chains) {
            moments.resize(chain.visibility.len(), Moments::default());
            moments.iter_mut().zip(chain.visibility).for_each(|(sum, one)| *sum = sum.plus(one));
            if is_first {
                *last = chain.last;
            }
        }
    }

    /// Tiles by their first pixel.
    fn tiles(&self) -> Vec<([u32; 2], Tile)> {
        let [width, height] = self.size;
        let columns = width.div_ceil(TILE);
        let mut tiles: Vec<_> = (0..columns * height.div_ceil(TILE))
            .map(|i| ([i % columns * TILE, i / columns * TILE], Tile::default()))
            .collect();
        for i in (0..width * height).filter(|&i| self.moments[0][i as usize].is_known()) {
            let (_, tile) = &mut tiles[((i / width / TILE) * columns + i % width / TILE) as usize];
            tile.pixels += 1.0;
            for (method, moments) in self.moments.iter().enumerate() {
                let of_pixel = moments[i as usize];
                tile.variances[method] += of_pixel.variance();
                tile.means[method] += of_pixel.mean();
            }
        }
        tiles
    }

    /// The variance of prev over that of ours.
    fn reduction(&self) -> Interval {
        let tiles = self.tiles();
        let [prev, ours] = [0, 1].map(|i| tiles.iter().map(|(_, tile)| tile.variances[i]).collect::<Vec<_>>());
        Interval::of_positive(tiles.len(), RESAMPLES, |times| mean(&prev, times) / mean(&ours, times))
    }

    fn mean(&self, of: impl Fn(&Moments) -> f64, method: usize) -> f64 {
        let known: Vec<f64> = self.moments[method].iter().filter(|moments| moments.is_known()).map(of).collect();
        known.iter().sum::<f64>() / known.len() as f64
    }

    /// Prev and ours, their visibility below, and beside them the image without and the ratio of the variances.
    fn picture(&self) -> Image {
        let [[prev, seen_by_prev, unseen], [ours, seen_by_ours, _]] = self.last.clone();
        let [a, b] = &self.moments;
        let pairs = a.iter().zip(b).map(|(a, b)| (a.variance(), b.variance()));
        let ratio = pairs.map(|(a, b)| if a > 0.0 { a / b / WHITE_RATIO } else { 0.0 });
        grid(&[prev, ours, unseen, seen_by_prev, seen_by_ours, grey(self.size, ratio)], 3)
    }

    fn table(&self) -> String {
        let mut text = "x,y,pixels,variance_prev,mean_prev,variance_ours,mean_ours\n".to_owned();
        for ([x, y], Tile { pixels, variances: [a, c], means: [b, d] }) in self.tiles() {
            let [a, b, c, d] = [a, b, c, d].map(|sum| if pixels > 0.0 { sum / pixels } else { 0.0 });
            let _ = writeln!(text, "{x},{y},{pixels},{a:.6},{b:.6},{c:.6},{d:.6}");
        }
        text
    }

    fn claims(&self) -> Vec<Claim> {
        let claim = |id, text: &str, found, holds| {
            let [text, scene] = [text, SCENE].map(str::to_owned);
            Claim { id, text, scene, found, holds: Some(holds) }
        };
        let [differing, all] = self.differing;
        let falls = "the variance of the visibility falls by 1.5 or more";
        let rays = self.shadow_rays;
        vec![
            claim(
                "T18",
                "sample, weight and confidence are the same bits in every reservoir of every frame",
                format!("{differing} of {all} differ"),
                differing == 0,
            ),
            Claim::of_interval("T19", falls, SCENE, Some(self.reduction()), [REDUCTION, f64::INFINITY]),
            claim("T17", "a pixel traces two shadow rays a frame at most", format!("{rays:.3}"), rays <= 2.0),
        ]
    }

    fn report(&self, protocol: Protocol, counted: u32, settings: &DiSettings, setup: &Setup) -> String {
        let [prev, ours] = [0, 1].map(|method| {
            let [variance, mean] = [self.mean(|m| m.variance(), method), self.mean(|m| m.mean(), method)];
            format!("| {} | {mean:.5} | {variance:.5} |\n", METHODS[method].0)
        });
        format!(
            "# The visibility term\n\nFigure 1 of the supplement of Tokuyoshi, *Efficient Visibility Reuse for Real-time \
             ReSTIR*.\n\n{}\n![Six images]({PICTURE})\n\nAbove: `{SCENE}` with the visibility of the selected sample (\"prev\"), with \
             the averaged one (\"ours\"), and without visibility, f(X) W. Below: the visibility of prev, of ours, and how many \
             times less that of ours varies, from black for 0 to white for {WHITE_RATIO}. The images are the last frame of the \
             first chain, of biased ReSTIR as in algorithm 1: preset `wis` with {} candidates and a neighbour within {:.1} \
             pixels.\n\n## Claims\n\n{}\n## The visibility of a pixel's reservoir\n\nOver {counted} frames of each of {} chains, after \
             {} that do not count; both methods have the same seeds. What counts are frames in which the \
             reservoir has a weight, the same ones for both. The mean over all pixels of each pixel's mean and variance \
             (frames of a chain are dependent, in the same way for both):\n\n| method | mean | variance |\n|---|---:|---:|\n{prev}{ours}\n\
             The interval of the ratio is a basic bootstrap's over tiles of {TILE} x {TILE} pixels; `tiles.csv` has each.\n",
            setup.markdown(""),
            settings.candidates,
            settings.radius,
            claim::table(&self.claims()),
            protocol.chains,
            protocol.warm_up,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_mean_and_variance() {
        let mut moments = Moments::default();
        [1.0, 2.0, 6.0].into_iter().for_each(|x| moments.push(x));
        assert_eq!((moments.mean(), moments.variance()), (3.0, 7.0));
    }
}
