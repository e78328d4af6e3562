//! How a property of a node changes with time.

use glam::{DQuat, DVec3};

use super::{Changed, unit};

/// Keys of a property, and what is between them. Before the first and after the last key the property stays as it is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Index into [`super::Rig::nodes`].
    pub node: usize,
    /// What changes.
    pub property: Property,
    /// What is between the keys.
    pub interpolation: Interpolation,
    /// At least one, ascending.
    pub times: Vec<f32>,
    /// One after the other as many numbers a key as the property has; thrice as many for [`Interpolation::CubicSpline`].
    pub values: Vec<f32>,
}

/// What of a node can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Property {
    /// Three numbers.
    Translation,
    /// A quaternion x, y, z, w, of any length but zero.
    Rotation,
    /// Three numbers.
    Scale,
    /// A number for each morph target of the node.
    Weights,
}

/// How values follow from those of the keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Interpolation {
    /// That of the key before.
    Step,
    /// In a straight line; rotations at constant speed, the shorter way.
    Linear,
    /// Cubic Hermite splines: a key has its derivative from before, its value and its derivative from there on.
    CubicSpline,
}

impl Property {
    /// As glTF names it.
    pub(in crate::scene) fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Scale => "scale",
            Self::Weights => "weights",
        }
    }

    /// How many numbers a value has, at a node with so many morph targets.
    pub(super) fn width(self, targets: usize) -> usize {
        match self {
            Self::Translation | Self::Scale => 3,
            Self::Rotation => 4,
            Self::Weights => targets,
        }
    }
}

impl Interpolation {
    /// How many values a key has.
    pub(super) fn values_per_key(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

impl Track {
    /// Writes down what the track says of its node at a time.
    pub(super) fn change(&self, node: &mut Changed, time: f64) {
        let value = self.at(time);
        match (self.property, value.as_slice()) {
            (Property::Translation, &[x, y, z]) => node.translation = Some(DVec3::new(x, y, z)),
            (Property::Rotation, &[x, y, z, w]) => node.rotation = Some(DQuat::from_xyzw(x, y, z, w)),
            (Property::Scale, &[x, y, z]) => node.scale = Some(DVec3::new(x, y, z)),
            (Property::Weights, _) => node.weights = Some(value),
            _ => (),
        }
    }

    pub(super) fn at(&self, time: f64) -> Vec<f64> {
        let next = self.times.partition_point(|&key| f64::from(key) <= time);
        let Some((before, [start, end])) = next.checked_sub(1).and_then(|before| {
            let times = [self.times[before], *self.times.get(next)?];
            Some((before, times.map(f64::from)))
        }) else {
            return self.value(next.min(self.times.len().saturating_sub(1)));
        };
        let share = (time - start) / (end - start);
        match self.interpolation {
            Interpolation::Step => self.value(before),
            Interpolation::Linear => self.linear(before, share),
            Interpolation::CubicSpline => self.cubic(before, share, end - start),
        }
    }

    fn linear(&self, before: usize, share: f64) -> Vec<f64> {
        let (a, b) = (self.value(before), self.value(before + 1));
        if let (Property::Rotation, &[ax, ay, az, aw], &[bx, by, bz, bw]) = (self.property, &*a, &*b) {
            let [from, to] = [DQuat::from_xyzw(ax, ay, az, aw), DQuat::from_xyzw(bx, by, bz, bw)].map(unit);
            return from.slerp(to, share).to_array().to_vec();
        }
        a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect()
    }

    /// The spline of glTF: derivatives are those by time.
    fn cubic(&self, before: usize, s: f64, duration: f64) -> Vec<f64> {
        let (s2, s3) = (s * s, s * s * s);
        let [leaving, arriving] = [duration * (s3 - 2.0 * s2 + s), duration * (s3 - s2)];
        let [from, to] = [2.0 * s3 - 3.0 * s2 + 1.0, 3.0 * s2 - 2.0 * s3];
        let ends = self.value(before).into_iter().zip(self.value(before + 1));
        let slopes = self.numbers(before, 2).into_iter().zip(self.numbers(before + 1, 0));
        ends.zip(slopes).map(|((a, b), (out, into))| from * a + leaving * out + to * b + arriving * into).collect()
    }

    /// The value of a key.
    fn value(&self, key: usize) -> Vec<f64> {
        self.numbers(key, self.interpolation.values_per_key() / 2)
    }

    /// One of the values that a key has.
    fn numbers(&self, key: usize, which: usize) -> Vec<f64> {
        let per_key = self.interpolation.values_per_key();
        let width = self.values.len() / (self.times.len() * per_key).max(1);
        let first = (key * per_key + which) * width;
        self.values.get(first..first + width).unwrap_or_default().iter().copied().map(f64::from).collect()
    }
}
