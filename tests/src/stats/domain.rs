//! Where samples lie: parametrised by the unit square such that equal areas of the square have equal measure, so that a
//! uniform grid of the square is a histogram, and integrals need no Jacobian.

use std::f64::consts::{PI, TAU};

/// How far rounding may take an `f32` sample out of its domain, relative to the domain's size.
const SLACK: f64 = 1.0e-5;

/// A set with a measure and an equal-measure map from the unit square.
pub trait Domain: Sync {
    /// An element.
    type Point;

    /// The element at the given coordinates in [0, 1]^2.
    fn point(&self, coordinates: [f64; 2]) -> Self::Point;

    /// The coordinates of an element; `None` for what is not in the domain.
    fn coordinates(&self, point: &Self::Point) -> Option<[f64; 2]>;

    /// The measure of the whole.
    fn measure(&self) -> f64;
}

/// `x` in [0, 1], if it is so within rounding.
fn inside(x: f64) -> Option<f64> {
    (-SLACK..=1.0 + SLACK).contains(&x).then(|| x.clamp(0.0, 1.0))
}

fn turn(y: f64, x: f64) -> f64 {
    (y.atan2(x) / TAU).rem_euclid(1.0)
}

/// The interval from `lo` to `hi`; only the first coordinate counts.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

impl Domain for Line {
    type Point = f64;

    fn point(&self, [s, _]: [f64; 2]) -> f64 {
        self.lo + s * (self.hi - self.lo)
    }

    fn coordinates(&self, x: &f64) -> Option<[f64; 2]> {
        Some([inside((x - self.lo) / (self.hi - self.lo))?, 0.5])
    }

    fn measure(&self) -> f64 {
        self.hi - self.lo
    }
}

/// The disk around the origin: squared radius and angle.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    /// Radius.
    pub radius: f64,
}

impl Domain for Disk {
    type Point = [f64; 2];

    fn point(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        let r = self.radius * s.sqrt();
        let (sin, cos) = (TAU * t).sin_cos();
        [r * cos, r * sin]
    }

    fn coordinates(&self, [x, y]: &[f64; 2]) -> Option<[f64; 2]> {
        Some([inside((x * x + y * y) / (self.radius * self.radius))?, turn(*y, *x)])
    }

    fn measure(&self) -> f64 {
        PI * self.radius * self.radius
    }
}

/// Unit vectors within an angle around +z, measured in steradians: depth below the pole and angle.
#[derive(Clone, Copy, Debug)]
pub struct Cap {
    /// `1 - cos` of the largest angle.
    pub versine: f64,
}

impl Cap {
    /// All directions.
    pub const SPHERE: Self = Self { versine: 2.0 };
    /// Those with z >= 0.
    pub const HEMISPHERE: Self = Self { versine: 1.0 };
}

impl Domain for Cap {
    type Point = [f64; 3];

    fn point(&self, [s, t]: [f64; 2]) -> [f64; 3] {
        let depth = s * self.versine;
        let r = (depth * (2.0 - depth)).max(0.0).sqrt();
        let (sin, cos) = (TAU * t).sin_cos();
        [r * cos, r * sin, 1.0 - depth]
    }

    fn coordinates(&self, [x, y, z]: &[f64; 3]) -> Option<[f64; 2]> {
        let r2 = x * x + y * y;
        let off = (r2 + z * z - 1.0).abs();
        if off.is_nan() || off >= SLACK {
            return None;
        }
        // the difference would lose the digits of a narrow cone
        let depth = if *z > 0.0 { r2 / (1.0 + z) } else { 1.0 - z };
        Some([inside(depth / self.versine)?, turn(*y, *x)])
    }

    fn measure(&self) -> f64 {
        TAU * self.versine
    }
}

/// A triangle, by the barycentric coordinates of its second and third vertex: squared distance from the first vertex
/// and position across.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Its area.
    pub area: f64,
}

impl Domain for Triangle {
    type Point = [f64; 2];

    fn point(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        let sum = s.sqrt();
        [sum * (1.0 - t), sum * t]
    }

    fn coordinates(&self, [b1, b2]: &[f64; 2]) -> Option<[f64; 2]> {
        let sum = b1 + b2;
        let across = if sum > 0.0 { b2 / sum } else { 0.5 };
        Some([inside(sum * sum)?, inside(across)?])
    }

    fn measure(&self) -> f64 {
        self.area
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip<D: Domain>(domain: &D) {
        for i in 0..9 {
            for j in 0..9 {
                let at = [(f64::from(i) + 0.5) / 9.0, (f64::from(j) + 0.5) / 9.0];
                let back = domain.coordinates(&domain.point(at)).expect("a point of the domain");
                assert!((at[0] - back[0]).abs() < 1e-12, "{at:?} {back:?}");
                assert!((at[1] - back[1]).abs() < 1e-12 || back[1] == 0.5, "{at:?} {back:?}");
            }
        }
    }

    #[test]
    fn coordinates_invert() {
        round_trip(&Line { lo: -2.0, hi: 5.0 });
        round_trip(&Disk { radius: 3.0 });
        round_trip(&Cap::SPHERE);
        round_trip(&Cap { versine: 1e-9 });
        round_trip(&Triangle { area: 2.0 });
    }

    #[test]
    fn what_is_outside_is_seen() {
        assert!(Line { lo: 0.0, hi: 1.0 }.coordinates(&1.1).is_none());
        assert!(Line { lo: 0.0, hi: 1.0 }.coordinates(&f64::NAN).is_none());
        assert!(Disk { radius: 1.0 }.coordinates(&[0.8, 0.8]).is_none());
        assert!(Cap::HEMISPHERE.coordinates(&[0.6, 0.0, -0.8]).is_none());
        assert!(Cap::SPHERE.coordinates(&[0.6, 0.0, 0.9]).is_none());
        assert!(Cap::SPHERE.coordinates(&[f64::NAN, 0.0, 1.0]).is_none());
        assert!(Triangle { area: 1.0 }.coordinates(&[0.6, 0.5]).is_none());
        assert!(Triangle { area: 1.0 }.coordinates(&[-0.1, 0.5]).is_none());
    }
}
