//! Boxes around meshes, which are looked at once, however often they are placed.

use glam::{DAffine3, DVec3};

use super::{Mesh, Scene, double};

/// Lower and upper corner of an axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box3 {
    pub(super) lo: DVec3,
    pub(super) hi: DVec3,
}

impl Box3 {
    /// That of no point.
    const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    fn of(points: impl Iterator<Item = DVec3>) -> Self {
        let numbers = points.filter(|point| !point.is_nan());
        numbers.fold(Self::EMPTY, |all, point| Self { lo: all.lo.min(point), hi: all.hi.max(point) })
    }

    /// Around the box where a transform places it; empty if it is.
    pub(super) fn placed(&self, transform: &DAffine3) -> Self {
        if self.lo.cmpgt(self.hi).any() {
            return Self::EMPTY;
        }
        let side = |of: usize, axis: usize| if of >> axis & 1 == 0 { self.lo[axis] } else { self.hi[axis] };
        Self::of((0..8).map(|of| transform.transform_point3(DVec3::from_array([0, 1, 2].map(|axis| side(of, axis))))))
    }
}

impl Mesh {
    /// Around its vertices.
    pub(super) fn box_of_vertices(&self) -> Box3 {
        Box3::of(self.positions.iter().map(|position| double(*position)))
    }
}

impl Scene {
    /// For each instance the box around that of its mesh.
    pub(super) fn placed_boxes(&self) -> impl Iterator<Item = Box3> {
        let boxes: Vec<Box3> = self.meshes.iter().map(|mesh| mesh.box_of_vertices()).collect();
        self.instances
            .iter()
            .map(move |instance| boxes.get(instance.mesh).map_or(Box3::EMPTY, |of| of.placed(&instance.transform)))
    }

    /// Around all of them, at time 0.
    pub(super) fn box_of_all(&self) -> Box3 {
        if self.animation != super::Animation::default() {
            return self.at(0.0).box_of_all();
        }
        self.placed_boxes().fold(Box3::EMPTY, |all, of| Box3 { lo: all.lo.min(of.lo), hi: all.hi.max(of.hi) })
    }
}
