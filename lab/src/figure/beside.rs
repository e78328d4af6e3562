//! Methods beside the walk, in renders that are independent of each other: by how much they differ, with error bars.

use restir::image::Image;
use restir::technique::path::{PathSettings, Subsurface};
use restir::{Error, buffers::SceneBuffers, scene::Scene};
use restir_cli::trial::{self, squared_difference};

use super::Environs;
use super::chains::{self, Protocol};
use super::picture;
use crate::bench::fit::{Estimate, student};

/// Renders of each method, by other random numbers.
pub(super) const RUNS: usize = 8;
/// Pixels along a side of the tiles that are compared.
pub(super) const TILE: u32 = 8;
/// What is usually compared: [`METHODS`] by their names, the walk last.
pub(super) const NAMES: [&str; 3] = ["profile", "hybrid", "walk"];
pub(super) const METHODS: [Subsurface; 3] = [Subsurface::Diffusion, Subsurface::Hybrid, Subsurface::Walk];
pub(super) const PROFILE: usize = 0;
pub(super) const HYBRID: usize = 1;
pub(super) const WALK: usize = 2;
/// Differences of this part of the mean are of full colour in maps.
const FULL: f64 = 0.5;

/// Path tracing by [`METHODS`].
pub(super) fn methods(max_depth: u32) -> [PathSettings; 3] {
    METHODS.map(|subsurface| PathSettings { subsurface, max_depth, ..PathSettings::default() })
}

/// Pictures of a scene by several methods, of which the last is what the others are compared with.
pub(super) struct Beside {
    size: [u32; 2],
    /// Red, green and blue of each pixel, by method and run.
    pictures: Vec<Vec<Vec<f64>>>,
    /// Sums of the same over tiles.
    tiles: Vec<Vec<Vec<f64>>>,
}

impl Beside {
    /// Renders [`RUNS`] pictures by each method, of so many samples a pixel.
    ///
    /// # Errors
    /// As of [`chains::run`].
    pub(super) fn of(
        environs: &mut impl Environs,
        what: &str,
        scene: &Scene,
        methods: &[PathSettings],
        (size, samples): ([u32; 2], u32),
    ) -> Result<Self, Error> {
        let scene = SceneBuffers::build(scene)?;
        let protocol = Protocol { size, warm_up: samples - 1, chains: RUNS as u32, accumulate: false };
        let chains =
            environs.run(what, |executor, observe| chains::run(executor, &scene, methods, protocol, observe))?;
        let pictures: Vec<Vec<Vec<f64>>> = chains.into_iter().map(|chains| chains.images).collect();
        let tiled = |runs: &Vec<Vec<f64>>| runs.iter().map(|picture| tiles(picture, size)).collect();
        let tiles = pictures.iter().map(tiled).collect();
        Ok(Self { size, pictures, tiles })
    }

    /// The mean of a method's pictures.
    pub(super) fn image(&self, method: usize) -> Image {
        let mean = mean(&self.pictures[method], &all());
        let pixels = mean.as_chunks().0.iter().map(|rgb: &[f64; 3]| rgb.map(|x| x as f32)).collect();
        Image { width: self.size[0], height: self.size[1], pixels }
    }

    /// A function of the methods' mean pictures, which are red, green and blue of each pixel.
    pub(super) fn statistic(&self, of: impl Fn(&[Vec<f64>]) -> f64) -> Estimate {
        jackknife(|runs| of(&self.pictures.iter().map(|pictures| mean(pictures, runs)).collect::<Vec<_>>()))
    }

    /// How much brighter a method's picture is than the last one's: 0.1 for a tenth.
    pub(super) fn brighter(&self, method: usize) -> Estimate {
        let light = |method: usize, runs: &[usize]| runs.iter().flat_map(|&run| &self.tiles[method][run]).sum::<f64>();
        jackknife(|runs| light(method, runs) / light(self.last(), runs) - 1.0)
    }

    /// The root of the mean squared difference of a method's tiles from the last one's, over their mean. The noise of both is taken off, by
    /// products of independent renders; what is left may be negative, and so is then the root.
    pub(super) fn error(&self, method: usize) -> Estimate {
        jackknife(|runs| root(self.squared(method, runs)))
    }

    /// Whether method `a` is nearer to the last one than `b` in this sense, if its interval of 95 % knows.
    pub(super) fn nearer(&self, a: usize, b: usize) -> Option<bool> {
        jackknife(|runs| self.squared(b, runs) - self.squared(a, runs)).is_positive()
    }

    /// The differences of tiles from the last method's: red where there is more light, blue where there is less.
    pub(super) fn map(&self, method: usize) -> Image {
        let (other, walk) = (mean(&self.tiles[method], &all()), mean(&self.tiles[self.last()], &all()));
        let scale = walk.len() as f64 / (FULL * walk.iter().sum::<f64>());
        let tile = |i: usize| (0..3).map(|c| other[3 * i + c] - walk[3 * i + c]).sum::<f64>() / 3.0 * scale;
        let [width, height] = self.size.map(|side| side.div_ceil(TILE));
        let pixels = (0..(width * height) as usize).map(|i| picture::signed(tile(i))).collect();
        picture::cropped(&picture::enlarged(&Image { width, height, pixels }, TILE), self.size)
    }

    fn last(&self) -> usize {
        self.pictures.len() - 1
    }

    /// The mean squared difference of tiles over the square of their mean, without the noise of either.
    fn squared(&self, method: usize, runs: &[usize]) -> f64 {
        let (these, walk) = (&self.tiles[method], &self.tiles[self.last()]);
        let whole = mean(walk, runs).iter().sum::<f64>() / walk[0].len() as f64;
        squared_difference(these, walk, runs) / (whole * whole)
    }
}

/// In percent, with its interval.
pub(super) fn percent(Estimate { value, half_width }: Estimate) -> String {
    format!("{:.1}", Estimate { value: 100.0 * value, half_width: 100.0 * half_width }) + " %"
}

/// Whether a number is within `tolerance` of zero, if its interval of 95 % knows.
pub(super) fn is_small(Estimate { value, half_width }: Estimate, tolerance: f64) -> Option<bool> {
    let (least, most) = (value.abs() - half_width, value.abs() + half_width);
    (most < tolerance || least > tolerance).then_some(most < tolerance)
}

fn all() -> [usize; RUNS] {
    std::array::from_fn(|run| run)
}

fn root(squared: f64) -> f64 {
    squared.signum() * squared.abs().sqrt()
}

/// The mean over some runs.
fn mean(runs: &[Vec<f64>], of: &[usize]) -> Vec<f64> {
    (0..runs[0].len()).map(|i| of.iter().map(|&run| runs[run][i]).sum::<f64>() / of.len() as f64).collect()
}

/// Sums over tiles of red, green and blue.
fn tiles(picture: &[f64], [width, height]: [u32; 2]) -> Vec<f64> {
    let across = width.div_ceil(TILE);
    let mut tiles = vec![0.0; 3 * (across * height.div_ceil(TILE)) as usize];
    for (i, rgb) in (0..).zip(picture.chunks_exact(3)) {
        let tile = i / width / TILE * across + i % width / TILE;
        (0..3).for_each(|c| tiles[3 * tile as usize + c] += rgb[c]);
    }
    tiles
}

/// A statistic of all runs with its interval of 95 %.
fn jackknife(of: impl Fn(&[usize]) -> f64) -> Estimate {
    let trial::Estimate { value, error } = trial::jackknife(RUNS, of);
    Estimate { value, half_width: student(RUNS - 1) * error }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 2 x 1 tiles: the walk is 1 with some noise, the other method `bias` more in the first tile.
    fn beside(bias: f64) -> Beside {
        let size = [2 * TILE, TILE];
        let noise = |run: usize, pixel: u32| 0.1 * f64::from((pixel as usize * 7 + run * 5) as u32 % 11) - 0.5;
        let picture = |run: usize, bias: f64| -> Vec<f64> {
            let off = |pixel: u32| if pixel % size[0] < TILE { bias } else { 0.0 };
            (0..size[0] * size[1]).flat_map(|pixel| [1.0 + noise(run, pixel) + off(pixel); 3]).collect()
        };
        let method = |seed: usize, bias: f64| (0..RUNS).map(|run| picture(seed + run, bias)).collect::<Vec<_>>();
        let pictures = vec![method(20, bias), method(3, 0.0), method(0, 0.0)];
        let tiled = |runs: &Vec<Vec<f64>>| runs.iter().map(|picture| tiles(picture, size)).collect();
        Beside { size, tiles: pictures.iter().map(tiled).collect(), pictures }
    }

    #[test]
    fn a_bias_is_found_below_the_noise() {
        let beside = beside(0.3);
        let near = |found: Estimate, value: f64| (found.value - value).abs() <= found.half_width + 1.0e-9;
        // a tile of two is off by 0.3
        let (error, light) = (beside.error(0), beside.brighter(0));
        assert!(near(error, 0.3 / 2.0_f64.sqrt()) && error.half_width < 0.05, "{error}");
        assert!(near(light, 0.15) && light.half_width < 0.05, "{light}");
        assert!(!near(error, 0.3) && !near(light, 0.3));
        assert!(near(beside.brighter(1), 0.0) && beside.error(1).value < 0.05);
        assert_eq!((beside.nearer(1, 0), beside.nearer(0, 1)), (Some(true), Some(false)));
        let found = beside.statistic(|pictures| pictures[0][0] - pictures[2][0]);
        assert!((found.value - 0.3).abs() < 0.3, "{found}");
    }

    #[test]
    fn maps_are_red_where_there_is_more_light() {
        let map = beside(0.3).map(0);
        let [r, g, b] = map.pixels[0];
        assert!(r > 0.99 && g < 0.5 && (g - b).abs() < 1.0e-6, "{:?}", map.pixels[0]);
        assert!(map.pixels[TILE as usize].iter().all(|&x| x > 0.9), "{:?}", map.pixels[TILE as usize]);
    }
}
