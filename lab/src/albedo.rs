//! `cargo lab albedo`: fits functions of cosine and roughness to what GGX reflects of light from everywhere.
//!
//! [`restir_shared::bsdf::albedo`] has their form. They are smooth in s, which is the cosine in the space where the
//! distribution of normals is uniform, and have a kink in the cosine itself that is as narrow as alpha: in it, polynomials of this
//! size err by 0.01.

use std::fmt::Write;
use std::path::Path;

use clap::Args;
use rayon::prelude::*;
use restir_tests::albedo::{Reflected, lobe, reflected};

use crate::fit::{Model, minimax};
use crate::{Error, report};

/// Options of `cargo lab albedo`.
#[derive(Args)]
pub struct Options {
    /// Replace shared/src/bsdf/albedo/fit.rs and docs/albedo.md.
    #[arg(long)]
    write: bool,
}

/// Intervals of the grids of roughnesses and cosines; these are spaced by a constant factor.
const INTERVALS: usize = 40;
const LEAST_ROUGHNESS: f64 = 0.01;
const LEAST_COSINE: f64 = 1.0 / 128.0;
/// The loss is fitted to so much less than it is, what balances it too, and Schlick's part to so much more, because what a
/// fit errs by towards loss only darkens, and the other way it makes light.
const LOSS_MARGIN: f64 = 1.8e-3;
const BALANCE_MARGIN: f64 = 2.6e-3;
const SCHLICK_MARGIN: f64 = 1.8e-3;
/// The mean over all cosines of what Schlick's weight does not reflect is fitted to so much more than it is.
const MEAN_MARGIN: f64 = 2.0e-4;
/// Cosines of the table from which g is made, spaced by a constant factor, and the least one.
const NODES: usize = 81;
const LEAST_NODE: f64 = 1.0e-4;
/// The least cosine for which g is fitted.
const LEAST_BALANCED: f64 = 4.0e-3;
/// Rounds in which g is found: each halves the logarithm of its error.
const ROUNDS: usize = 60;
/// The denominator must not come nearer to zero on the grid.
const LEAST_DENOMINATOR: f64 = 0.08;

/// Powers of s in the polynomials A, B and D, each with four powers of alpha.
const EDGE: usize = 2;
const DEEP: usize = 2;
const BELOW: usize = 3;
const COLUMNS: usize = 4;
/// Terms of H, each with so many powers of r; and powers of r in the means.
const SCHLICK: [usize; 2] = [5, 5];
const MEAN: usize = 8;

/// A point of the grid and what depends on it alone.
#[derive(Clone, Copy)]
struct Point {
    r: f64,
    alpha: f64,
    mu: f64,
    s: f64,
    p: f64,
}

impl Point {
    fn new(r: f64, mu: f64) -> Self {
        let alpha = r * r;
        let m = (alpha * alpha * (1.0 - mu * mu) + mu * mu).sqrt();
        let s = mu / m;
        Self { r, alpha, mu, s, p: (1.0 - s * s).max(0.0).sqrt() }
    }

    /// The monomials of a polynomial in s and alpha, times `factor`.
    fn monomials(&self, rows: usize, factor: f64) -> Vec<f64> {
        let row = |i: usize| (0..COLUMNS).map(move |k| factor * self.s.powi(i as i32) * self.alpha.powi(k as i32));
        (0..rows).flat_map(row).collect()
    }

    /// Those above and below the line of Q.
    fn quotient(&self) -> [Vec<f64>; 2] {
        let mut above = self.monomials(EDGE, self.p * self.p);
        above.extend(self.monomials(DEEP, self.alpha * self.alpha));
        [above, self.monomials(BELOW, self.s)]
    }

    /// Those of H.
    fn cosine(&self) -> Vec<f64> {
        let rows = [1.0, self.s, self.mu, self.mu * self.mu, self.s * self.mu];
        rows.iter().flat_map(|row| (0..SCHLICK[1]).map(move |k| row * self.r.powi(k as i32))).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The parameters of all functions.
#[derive(Default)]
struct Fit {
    lost: Vec<f64>,
    balance: Vec<f64>,
    schlick: Vec<f64>,
    mean_lost: Vec<f64>,
    mean_schlick: Vec<f64>,
}

fn quotient(parameters: &[f64], at: &Point) -> f64 {
    let [above, below] = at.quotient();
    let (a, b) = parameters.split_at(above.len());
    dot(a, &above) / (1.0 + dot(b, &below))
}

impl Fit {
    fn lost(&self, at: &Point) -> f64 {
        (at.s * quotient(&self.lost, at)).clamp(0.0, 1.0)
    }

    fn gain(&self, at: &Point) -> f64 {
        1.0 + quotient(&self.balance, at)
    }

    /// What facets return that reflect Schlick's weight.
    fn schlick(&self, at: &Point) -> f64 {
        let c = (at.mu + at.alpha * at.p * dot(&self.schlick, &at.cosine())).clamp(0.0, 1.0);
        (1.0 - self.lost(at)) * (1.0 - c).powi(5)
    }

    /// `2 integral f(mu) mu d mu` at a roughness.
    fn mean(r: f64, f: impl Fn(&Point) -> f64) -> f64 {
        const STEPS: usize = 4000;
        // squared steps: the functions change fastest where mu is small
        let at = |i: usize| ((i as f64 + 0.5) / STEPS as f64).powi(2);
        let width = |i: usize| 2.0 * (i as f64 + 0.5) / (STEPS * STEPS) as f64;
        (0..STEPS).map(|i| 2.0 * f(&Point::new(r, at(i))) * at(i) * width(i)).sum()
    }

    fn mean_lost(&self, r: f64) -> f64 {
        (r * r * polynomial(&self.mean_lost, r)).max(0.0)
    }

    fn mean_schlick(&self, r: f64) -> f64 {
        polynomial(&self.mean_schlick, r)
    }

    /// What white metal returns.
    fn metal(&self, at: &Point) -> f64 {
        let mut sum = 0.0;
        lobe(at.r, at.mu, |share, cos, _| sum += share * self.gain(&Point::new(at.r, cos)));
        self.gain(at) * sum
    }

    /// What a white base returns under a coat with the reflectance `f0` at normal incidence: the coat's part, which is known, and
    /// the coupled one.
    fn coated(&self, at: &Point, f0: f64, known: Reflected, means: [f64; 2]) -> f64 {
        let coat = f0 * (known.all - known.schlick) + known.schlick;
        let mixed = |lost: f64, schlick: f64| f0 * lost + (1.0 - f0) * schlick;
        let through = mixed(self.lost(at), 1.0 - self.schlick(at));
        coat + through * mixed(means[0], means[1]) / mixed(self.mean_lost(at.r), self.mean_schlick(at.r))
    }
}

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn roughnesses() -> Vec<f64> {
    let step = |i: usize| LEAST_ROUGHNESS + (1.0 - LEAST_ROUGHNESS) * i as f64 / INTERVALS as f64;
    (0..=INTERVALS).map(step).collect()
}

fn grid(shift: f64) -> Vec<Point> {
    let cosine = |i: usize| LEAST_COSINE.powf(((i as f64 - shift) / INTERVALS as f64).clamp(0.0, 1.0));
    let roughness = |r: f64| (r - shift * (1.0 - LEAST_ROUGHNESS) / INTERVALS as f64).max(LEAST_ROUGHNESS);
    let row = |r: f64| (0..=INTERVALS).map(move |i| Point::new(roughness(r), cosine(i)));
    roughnesses().into_iter().flat_map(row).collect()
}

/// Q, of which `lead(point) Q` should be the target.
fn fit_quotient(points: &[Point], target: &[f64], lead: impl Fn(&Point) -> f64 + Sync) -> (Vec<f64>, f64) {
    let rows: Vec<_> = points.iter().map(Point::quotient).collect();
    let evaluate = |c: &[f64], i: usize| {
        let ([above, below], lead) = (&rows[i], lead(&points[i]));
        let (a, b) = c.split_at(above.len());
        let denominator = 1.0 + dot(b, below);
        let value = lead * dot(a, above) / denominator;
        let slopes = above.iter().map(|x| lead * x / denominator).chain(below.iter().map(|x| -value * x / denominator));
        (denominator > LEAST_DENOMINATOR).then(|| (value, slopes.collect()))
    };
    minimax(&Model { points: points.len(), target, evaluate: &evaluate }, vec![0.0; (EDGE + DEEP + BELOW) * COLUMNS])
}

/// g less 1 at a roughness, at each cosine of a table: the fixed point of `g = sqrt(g / T g)`, where T is the lobe's operator.
fn balance(r: f64) -> Vec<(f64, f64)> {
    let cosine = |i: usize| LEAST_NODE.powf(1.0 - i as f64 / (NODES - 1) as f64);
    let place = |cos: f64| (1.0 - cos.max(LEAST_NODE).ln() / LEAST_NODE.ln()) * (NODES - 1) as f64;
    let mut operator = vec![[0.0; NODES]; NODES];
    for (i, row) in operator.iter_mut().enumerate() {
        lobe(r, cosine(i), |share, cos, _| {
            let node = (place(cos) as usize).min(NODES - 2);
            let rest = place(cos) - node as f64;
            row[node] += share * (1.0 - rest);
            row[node + 1] += share * rest;
        });
    }
    let mut gain = [1.0_f64; NODES];
    for _ in 0..ROUNDS {
        let old = gain;
        for (new, row) in gain.iter_mut().zip(&operator) {
            *new = (*new / dot(row, &old)).sqrt();
        }
    }
    (0..NODES).map(|i| (cosine(i), gain[i] - 1.0)).collect()
}

fn fit_balance() -> (Vec<f64>, f64) {
    let tables: Vec<_> = roughnesses().into_par_iter().map(|r| (r, balance(r))).collect();
    let rows = tables.iter().flat_map(|(r, row)| row.iter().map(move |&(mu, gain)| (Point::new(*r, mu), gain)));
    let rows = rows.filter(|(at, _)| at.mu >= LEAST_BALANCED);
    let (points, target): (Vec<_>, Vec<_>) = rows.map(|(at, gain)| (at, gain - BALANCE_MARGIN)).unzip();
    fit_quotient(&points, &target, |_| 1.0)
}

/// H, so that Schlick's part is that of the table and the margin.
fn fit_schlick(points: &[Point], table: &[Reflected], lost: &Fit) -> (Vec<f64>, f64) {
    let kept: Vec<f64> = points.iter().map(|at| 1.0 - lost.lost(at)).collect();
    let rows: Vec<_> = points.iter().map(Point::cosine).collect();
    let target: Vec<f64> = table.iter().map(|known| known.schlick + SCHLICK_MARGIN).collect();
    // H itself is linear in the parameters: its least error, times what a change of it does, is where the search begins
    let slope = |i: usize, x: f64| -5.0 * kept[i] * x.powi(4) * points[i].alpha * points[i].p;
    let complements: Vec<f64> = (0..points.len()).map(|i| (target[i] / kept[i]).powf(0.2).min(1.0)).collect();
    let wanted: Vec<f64> = (0..points.len())
        .map(|i| -5.0 * kept[i] * complements[i].powi(4) * (1.0 - points[i].mu - complements[i]))
        .collect();
    let linear = |c: &[f64], i: usize| {
        let slopes: Vec<f64> = rows[i].iter().map(|row| slope(i, complements[i]) * row).collect();
        Some((dot(c, &slopes), slopes))
    };
    let zeros = vec![0.0; SCHLICK[0] * SCHLICK[1]];
    let (start, _) = minimax(&Model { points: points.len(), target: &wanted, evaluate: &linear }, zeros);
    let evaluate = |c: &[f64], i: usize| {
        let at = &points[i];
        let x = (1.0 - at.mu - at.alpha * at.p * dot(c, &rows[i])).clamp(0.0, 1.0);
        let slope = slope(i, x);
        Some((kept[i] * x.powi(5), rows[i].iter().map(|row| slope * row).collect()))
    };
    minimax(&Model { points: points.len(), target: &target, evaluate: &evaluate }, start)
}

/// A mean and a margin as a polynomial in r, times `scale(r)`.
fn fit_mean(exact: &[f64], scale: impl Fn(f64) -> f64 + Sync, margin: f64) -> (Vec<f64>, f64) {
    let at = roughnesses();
    let target: Vec<f64> = exact.iter().map(|mean| mean + margin).collect();
    let evaluate = |c: &[f64], i: usize| {
        let slopes: Vec<f64> = (0..MEAN).map(|k| scale(at[i]) * at[i].powi(k as i32)).collect();
        Some((dot(c, &slopes), slopes))
    };
    minimax(&Model { points: at.len(), target: &target, evaluate: &evaluate }, vec![0.0; MEAN])
}

/// Fits, prints what white surfaces return, and writes where asked.
///
/// # Errors
/// [`Error::Failed`] if a white surface returns more than 1.0005 or less than 0.99, [`Error::Host`] if a file cannot be
/// written.
pub fn run(options: &Options) -> Result<(), Error> {
    let points = grid(0.0);
    let table: Vec<Reflected> = points.par_iter().map(|at| reflected(at.r, at.mu)).collect();
    let mut fit = Fit::default();
    let mut errors = [0.0; 5];
    let target: Vec<f64> = table.iter().map(|known| 1.0 - known.all - LOSS_MARGIN).collect();
    (fit.lost, errors[0]) = fit_quotient(&points, &target, |at| at.s);
    (fit.balance, errors[1]) = fit_balance();
    (fit.schlick, errors[2]) = fit_schlick(&points, &table, &fit);
    let means =
        |f: &(dyn Fn(&Point) -> f64 + Sync)| roughnesses().par_iter().map(|&r| Fit::mean(r, f)).collect::<Vec<_>>();
    (fit.mean_lost, errors[3]) = fit_mean(&means(&|at| fit.lost(at)), |r| r * r, 0.0);
    (fit.mean_schlick, errors[4]) = fit_mean(&means(&|at| 1.0 - fit.schlick(at)), |_| 1.0, MEAN_MARGIN);
    eprintln!("largest errors of L, g, Schlick's part and the means: {errors:?}");
    let (text, [least, most]) = judge(&fit);
    if options.write {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("shared").join("src/bsdf/albedo/fit.rs");
        report::write(&path, &constants(&fit))?;
    }
    report::publish("albedo", &text, options.write)?;
    report::judge("white surfaces", (least < 0.99 || most > 1.0005).then(|| format!("return {least:.5} to {most:.5}")))
}

/// The report, between the points of the grid, and the least and the most that any white surface returns.
fn judge(fit: &Fit) -> (String, [f64; 2]) {
    let points: Vec<Point> = grid(0.5).into_iter().filter(|at| at.mu >= 1.0 / 64.0).collect();
    let iors: Vec<f64> = (0..=8).map(|i| 1.0 + 0.25 * f64::from(i)).collect();
    let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
    let mut text = String::new();
    let rows: Vec<(f64, Vec<[f64; 2]>)> = points
        .par_chunk_by(|a, b| a.r == b.r)
        .map(|chunk| {
            let r = chunk[0].r;
            let means = [Fit::mean(r, |at| fit.lost(at)), Fit::mean(r, |at| 1.0 - fit.schlick(at))];
            let mut columns = vec![[f64::INFINITY, f64::NEG_INFINITY]; iors.len() + 1];
            for at in chunk {
                let known = reflected(r, at.mu);
                let metal = fit.metal(at);
                let coats = iors.iter().map(|n| ((n - 1.0) / (n + 1.0)).powi(2));
                let all = std::iter::once(metal).chain(coats.map(|f0| fit.coated(at, f0, known, means)));
                for (column, value) in columns.iter_mut().zip(all) {
                    *column = [column[0].min(value), column[1].max(value)];
                }
            }
            (r, columns)
        })
        .collect();
    for (r, columns) in &rows {
        let _ = write!(text, "| {r:.3} |");
        for [lo, hi] in columns {
            bounds = [bounds[0].min(*lo), bounds[1].max(*hi)];
            let _ = write!(text, " {lo:.4} .. {hi:.4} |");
        }
        text.push('\n');
    }
    let head = format!(
        "# What white surfaces return of light from everywhere\n\nThe specular part by quadrature (512 x 384 nodes), the \
         coupled part by the fits of `restir_shared::bsdf`; the least and the most over cosines from 1/64 to 1, at \
         roughnesses between those that were fitted. The whole of it is {:.4} .. {:.4}. Made by `cargo lab albedo \
         --write`.\n\n| roughness | metal | {} |\n|---:|{}\n",
        bounds[0],
        bounds[1],
        iors.iter().map(|n| format!("ior {n}")).collect::<Vec<_>>().join(" | "),
        "---|".repeat(iors.len() + 1),
    );
    (head + &text, bounds)
}

/// The source of the constants, under the module's documentation as it is.
fn constants(fit: &Fit) -> String {
    let written = include_str!("../../shared/src/bsdf/albedo/fit.rs");
    let mut text: String =
        written.lines().take_while(|line| line.starts_with("//!")).flat_map(|line| [line, "\n"]).collect();
    let numbers = |row: &[f64]| row.iter().map(|&c| format!("{:?}", c as f32)).collect::<Vec<_>>().join(", ");
    let mut rows = |doc: &str, name: &str, all: &[f64], columns: usize| {
        let rows: Vec<String> = all.chunks(columns).map(|row| format!("    [{}],\n", numbers(row))).collect();
        let (count, rows) = (rows.len(), rows.concat());
        let _ = write!(text, "\n/// {doc}\npub const {name}: [[f32; {columns}]; {count}] = [\n{rows}];\n");
    };
    rows("L: rows for A, B and D by power of s, columns by power of alpha.", "LOST", &fit.lost, COLUMNS);
    rows("g: rows for A, B and D by power of s, columns by power of alpha.", "BALANCE", &fit.balance, COLUMNS);
    rows("H: rows for 1, s, mu, mu^2 and s mu, columns by power of r.", "SCHLICK", &fit.schlick, SCHLICK[1]);
    for (doc, name, row) in [
        ("The mean of L over alpha, by power of r.", "MEAN_LOST", &fit.mean_lost),
        ("The mean of what Schlick's weight does not reflect, by power of r.", "MEAN_SCHLICK", &fit.mean_schlick),
    ] {
        let _ = write!(text, "\n/// {doc}\npub const {name}: [f32; {MEAN}] = [{}];\n", numbers(row));
    }
    text
}
