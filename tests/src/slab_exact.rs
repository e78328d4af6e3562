//! What a slab of a scattering medium reflects and transmits, without random numbers: by doubling a layer that is so thin that light collides at most
//! once in it (van de Hulst 1980), in `f64`, over directions of a Gaussian quadrature. It shares no code with the kernels or the walks.

use std::f64::consts::PI;

use crate::walk_f64::Border;

/// Directions on each side of a critical angle, or of the middle where there is none.
const NODES: usize = 20;
/// The first layer is the slab's depth over 2 to this power.
const DOUBLINGS: i32 = 24;

/// An infinitely wide slab.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// In mean free paths.
    pub depth: f64,
    /// What of a collision is scattered.
    pub albedo: f64,
    /// Mean cosine of the angle of scattering.
    pub anisotropy: f64,
    /// Both borders.
    pub border: Border,
}

/// A linear map of radiance by direction, row by row.
type Map = Vec<Vec<f64>>;

/// Nodes and weights of Gauss and Legendre's quadrature between two ends.
fn gauss(count: usize, [lo, hi]: [f64; 2]) -> Vec<[f64; 2]> {
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let [value, before] = legendre(count, x);
            slope = count as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        let half = 0.5 * (hi - lo);
        [lo + half * (1.0 + x), half * 2.0 / ((1.0 - x * x) * slope * slope)]
    };
    (0..count).map(node).collect()
}

/// Legendre's polynomial of a degree, and that of the degree before.
fn legendre(degree: usize, x: f64) -> [f64; 2] {
    (1..degree).fold([if degree == 0 { 1.0 } else { x }, 1.0], |[value, before], l| {
        let l = l as f64;
        [((2.0 * l + 1.0) * x * value - l * before) / (l + 1.0), value]
    })
}

/// Henyey and Greenstein's function between two cosines, averaged over azimuths, by its series; 1 where all directions are alike.
fn phase(g: f64, a: f64, b: f64) -> f64 {
    let terms = (0..64).map(|l| (2 * l + 1) as f64 * g.powi(l as i32) * legendre(l, a)[0] * legendre(l, b)[0]);
    terms.sum()
}

fn product(a: &Map, b: &Map) -> Map {
    let entry = |row: &[f64], j: usize| row.iter().zip(b).map(|(x, other)| x * other[j]).sum();
    a.iter().map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect()).collect()
}

/// The X of `(1 - a) X = b`, by elimination.
fn solve(a: &Map, b: &Map) -> Map {
    let n = a.len();
    let identity = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let left = |i: usize| (0..n).map(move |j| identity(i, j) - a[i][j]);
    let mut rows: Map = (0..n).map(|i| left(i).chain(b[i].iter().copied()).collect()).collect();
    for pivot in 0..n {
        let largest = (pivot..n).max_by(|&i, &j| rows[i][pivot].abs().total_cmp(&rows[j][pivot].abs()));
        rows.swap(pivot, largest.unwrap_or(pivot));
        let chosen = rows[pivot].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = (row[pivot] - identity(i, pivot)) / chosen[pivot];
            row.iter_mut().zip(&chosen).for_each(|(x, of_pivot)| *x -= factor * of_pivot);
        }
    }
    rows.into_iter().map(|row| row[n..].to_vec()).collect()
}

/// What a smooth interface to a relative index `n` reflects.
fn fresnel(cos: f64, n: f64) -> f64 {
    let square = 1.0 - (1.0 - cos * cos) / (n * n);
    if square <= 0.0 {
        return 1.0;
    }
    let bent = square.sqrt();
    let [s, p] = [(cos - n * bent) / (cos + n * bent), (n * cos - bent) / (n * cos + bent)];
    0.5 * (s * s + p * p)
}

impl Border {
    /// What is mirrored from inside.
    fn mirrored(self, cos: f64) -> f64 {
        match self {
            Self::Open => 0.0,
            Self::DenserOutside(n) => fresnel(cos, n),
            Self::Dielectric(n) => fresnel(cos, 1.0 / n),
        }
    }
}

impl Slab {
    /// Radiance of the lit side and of the other one under a white sky on one side, seen at a cosine to the normal; the mirror image of the sky is part of it.
    pub fn radiance(&self, cos: f64) -> [f64; 2] {
        let inside = match self.border {
            Border::Dielectric(n) => (1.0 - (1.0 - cos * cos) / (n * n)).sqrt(),
            Border::Open | Border::DenserOutside(_) => cos,
        };
        let middle = if let Border::Dielectric(n) = self.border { (1.0 - 1.0 / (n * n)).sqrt() } else { 0.5 };
        // the direction that is looked along counts nothing in sums over directions
        let nodes: Vec<[f64; 2]> =
            [gauss(NODES, [0.0, middle]), gauss(NODES, [middle, 1.0]), vec![[inside, 0.0]]].concat();
        let [back, other] = self.within(&nodes);
        match self.border {
            Border::Dielectric(n) => {
                let passes = 1.0 - self.border.mirrored(inside);
                let last = nodes.len() - 1;
                let [back, other] = [back[last], other[last]].map(|inside| passes * inside / (n * n));
                [fresnel(cos, n) + back, other]
            }
            Border::Open | Border::DenserOutside(_) => {
                let leaves = |light: &[f64]| {
                    let part = |([mu, weight], light): (&[f64; 2], &f64)| {
                        2.0 * mu * weight * (1.0 - self.border.mirrored(*mu)) * light
                    };
                    nodes.iter().zip(light).map(part).sum()
                };
                [leaves(&back), leaves(&other)]
            }
        }
    }

    /// Radiance that reaches both borders from inside.
    fn within(&self, nodes: &[[f64; 2]]) -> [Vec<f64>; 2] {
        let [reflects, passes] = self.layer(nodes);
        let n = nodes.len();
        let mirrored = |i: usize| self.border.mirrored(nodes[i][0]);
        let enters = |i: usize| match self.border {
            Border::Dielectric(index) => (1.0 - mirrored(i)) * index * index,
            Border::Open | Border::DenserOutside(_) => 1.0,
        };
        // of both borders: what comes from inside is what was reflected and passed of what goes in there
        let of = |map: &Map, i: usize, j: usize| map[i][j] * mirrored(j);
        let row = |side: usize, i: usize| {
            let [near, far] = if side == 0 { [&reflects, &passes] } else { [&passes, &reflects] };
            (0..n).map(|j| of(near, i, j)).chain((0..n).map(|j| of(far, i, j))).collect()
        };
        let maps: Map = (0..2).flat_map(|side| (0..n).map(move |i| (side, i))).map(|(side, i)| row(side, i)).collect();
        let lit = |map: &Map| {
            map.iter().map(|row| vec![row.iter().enumerate().map(|(j, x)| x * enters(j)).sum()]).collect::<Map>()
        };
        let found = solve(&maps, &[lit(&reflects), lit(&passes)].concat());
        let side = |from: usize| found[from..from + n].iter().map(|row| row[0]).collect();
        [side(0), side(n)]
    }

    /// What the slab reflects and passes of radiance, without its borders.
    fn layer(&self, nodes: &[[f64; 2]]) -> [Map; 2] {
        let thin = self.depth * 0.5_f64.powi(DOUBLINGS);
        let scattered = |i: usize, j: usize, sign: f64| {
            let ([to, _], [from, weight]) = (nodes[i], nodes[j]);
            0.5 * self.albedo * thin / to * phase(self.anisotropy, to, sign * from) * weight
        };
        let straight = |i: usize, j: usize| if i == j { (-thin / nodes[i][0]).exp() } else { 0.0 };
        let map = |entry: &dyn Fn(usize, usize) -> f64| -> Map {
            (0..nodes.len()).map(|i| (0..nodes.len()).map(|j| entry(i, j)).collect()).collect()
        };
        let mut layer = [map(&|i, j| scattered(i, j, -1.0)), map(&|i, j| straight(i, j) + scattered(i, j, 1.0))];
        for _ in 0..DOUBLINGS {
            let [reflects, passes] = &layer;
            // between two layers light goes to and fro
            let between = product(reflects, reflects);
            let down = solve(&between, passes);
            let up = product(passes, &product(reflects, &down));
            let all = up.iter().zip(reflects).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect();
            layer = [all, product(passes, &down)];
        }
        layer
    }

    /// What is reflected and transmitted after just one collision: by the slope at an albedo of zero, between one above and one below it that are as large as
    /// digits of a thin layer ask for.
    pub fn once(&self, cos: f64) -> [f64; 2] {
        const SMALL: f64 = 3.0e-3;
        let [less, more] = [-SMALL, SMALL].map(|albedo| Self { albedo, ..*self }.radiance(cos));
        [0, 1].map(|side| (more[side] - less[side]) * self.albedo / (2.0 * SMALL))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk_f64::unscattered;

    const OPEN: Slab = Slab { depth: 1.0, albedo: 0.9, anisotropy: 0.0, border: Border::Open };

    fn near(found: [f64; 2], expected: [f64; 2], within: f64) {
        let off = |i: usize| (found[i] - expected[i]).abs();
        assert!(off(0) < within && off(1) < within, "{found:?}, not {expected:?}");
    }

    #[test]
    fn slabs_are_those_that_are_known() {
        near(Slab { albedo: 0.0, ..OPEN }.radiance(0.7), [0.0, unscattered(1.0)], 1.0e-7);
        // walks of other hands, known to 5e-4
        near(OPEN.radiance(0.7), [0.3529, 0.4746], 1.0e-3);
        // 0.9 times the integrals of E2(t) E2(t) and of E2(t) E2(1 - t)
        near(OPEN.once(0.7), [0.177_034, 0.104_614], 1.0e-5);
        near(Slab { anisotropy: 0.5, ..OPEN }.radiance(0.7), [0.2278, 0.5986], 1.0e-3);
        near(Slab { depth: 4.0, ..OPEN }.radiance(0.7), [0.4731, 0.0903], 1.0e-3);
        near(Slab { depth: 10.0, albedo: 0.99, anisotropy: 0.8, ..OPEN }.radiance(0.7), [0.5216, 0.3074], 1.0e-3);
        // Chandrasekhar's half space of albedo 0.9
        near(Slab { depth: 60.0, ..OPEN }.radiance(0.7), [0.4777, 0.0], 1.0e-3);
    }

    #[test]
    fn nothing_is_lost_in_white_slabs_and_no_border_is_one_of_index_1() {
        for border in [OPEN.border, Border::DenserOutside(1.4), Border::Dielectric(1.4)] {
            for anisotropy in [0.0, 0.5] {
                let [back, other] = Slab { albedo: 1.0, anisotropy, border, ..OPEN }.radiance(0.7);
                assert!((back + other - 1.0).abs() < 1.0e-5, "{border:?} {anisotropy}: {back} and {other}");
            }
        }
        let none = Slab { border: Border::DenserOutside(1.0 + 1.0e-9), ..OPEN };
        near(none.radiance(0.7), OPEN.radiance(0.7), 1.0e-7);
    }

    #[test]
    fn a_thin_slab_is_one_that_scatters_once() {
        let thin = Slab { depth: 1.0e-3, ..OPEN };
        let [back, _] = thin.radiance(0.7);
        assert!((back / thin.once(0.7)[0] - 1.0).abs() < 5.0e-3);
    }
}
