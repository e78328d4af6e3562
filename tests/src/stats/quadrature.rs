//! Adaptive integration over rectangles of the unit square.

/// Nodes and weights of Gauss and Legendre's rule on [0, 1], exact for polynomials of degree 7.
const RULE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// Divisions into four, one in the other.
const DEPTH: u32 = 9;

/// A rectangle by its lower corner and its sides.
#[derive(Clone, Copy)]
pub(super) struct Rectangle {
    pub(super) corner: [f64; 2],
    pub(super) sides: [f64; 2],
}

impl Rectangle {
    fn rule(self, f: &impl Fn([f64; 2]) -> f64) -> f64 {
        let at = |axis: usize, node: f64| self.corner[axis] + node * self.sides[axis];
        let row =
            |(y, weight): &(f64, f64)| weight * RULE.iter().map(|(x, w)| w * f([at(0, *x), at(1, *y)])).sum::<f64>();
        self.sides[0] * self.sides[1] * RULE.iter().map(row).sum::<f64>()
    }

    fn quarters(self) -> [Self; 4] {
        let sides = self.sides.map(|side| 0.5 * side);
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|offset| Self {
            corner: std::array::from_fn(|axis| self.corner[axis] + offset[axis] * sides[axis]),
            sides,
        })
    }

    /// The integral of `f`, to about `tolerance`, if no detail of `f` is so narrow that the nodes miss it.
    pub(super) fn integrate(self, f: &impl Fn([f64; 2]) -> f64, tolerance: f64) -> f64 {
        self.refine(f, tolerance, self.rule(f), DEPTH)
    }

    fn refine(self, f: &impl Fn([f64; 2]) -> f64, tolerance: f64, coarse: f64, depth: u32) -> f64 {
        let quarters = self.quarters();
        let parts = quarters.map(|quarter| quarter.rule(f));
        let fine: f64 = parts.iter().sum();
        if depth == 0 || (fine - coarse).abs() <= tolerance {
            return fine;
        }
        let refined = |(quarter, part): (Self, f64)| quarter.refine(f, 0.5 * tolerance, part, depth - 1);
        quarters.into_iter().zip(parts).map(refined).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Rectangle = Rectangle { corner: [0.0, 0.0], sides: [1.0, 1.0] };

    #[test]
    fn smooth_peaked_and_broken_functions() {
        assert!((UNIT.integrate(&|[x, y]| x.powi(7) * y.powi(6), 1e-3) - 1.0 / 56.0).abs() < 1e-15);
        let peak = UNIT.integrate(&|[x, _]| 1e2 * (-1e2 * x).exp(), 1e-9);
        assert!((peak - 1.0).abs() < 1e-7, "{peak}");
        let step = UNIT.integrate(&|[x, y]| if x + y < 0.7 { 1.0 } else { 0.0 }, 1e-7);
        assert!((step - 0.245).abs() < 1e-4, "{step}");
    }
}
