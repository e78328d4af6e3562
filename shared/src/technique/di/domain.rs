//! What samples are: addresses of lights, which move between pixels and frames with a Jacobian of 1.

use super::pixel::Pixel;
use super::stored::Stored;
use super::{DI_MIS_VISIBILITY, DI_OTHER_FRAME, DI_TRANSMITTANCE, DiParams, Evaluation, Planes, evaluate};
use crate::resample::domain::{Domain, Pixels, Shifted, Source};
use crate::resample::reproject::{Grid, Place};
use crate::resample::similar::Facet;
use crate::scene::{AddressedLights, Frames, LightAddress};
use crate::transport::{Vertex, transmittance};
use glam::{UVec4, Vec3};

/// Light at pixels of one frame or two.
#[derive(Clone, Copy)]
pub(super) struct Light<F> {
    pub(super) frames: F,
    pub(super) flags: u32,
}

/// A pixel that light is brought to, in the scene of its frame.
pub(super) struct Receiver<S> {
    pub(super) scene: S,
    pub(super) vertex: Vertex,
}

impl<F> Light<F> {
    #[inline(always)]
    pub(super) fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// Whether what a reservoir keeps of a visibility is not good enough for MIS: it has a colour.
    #[inline(always)]
    pub(super) fn forgets(&self) -> bool {
        self.has(DI_MIS_VISIBILITY) & self.has(DI_TRANSMITTANCE)
    }

    /// Whether a pixel is of another frame.
    #[inline(always)]
    fn is_elsewhere(&self, pixel: Source) -> bool {
        self.has(DI_OTHER_FRAME) & pixel.is_other
    }
}

impl<F: Frames> Domain for Light<F> {
    type Sample = LightAddress;
    type Receiver = Receiver<F::Scene>;
    type Evaluation = Evaluation;

    #[inline(always)]
    fn shift(
        &self,
        sample: LightAddress,
        from: Source,
        to: Source,
        _receiver: &Receiver<F::Scene>,
    ) -> Shifted<LightAddress> {
        let of_other = self.is_elsewhere(from);
        let sample = if of_other == self.is_elsewhere(to) { sample } else { self.frames.counterpart(sample, of_other) };
        Shifted { sample, jacobian: 1.0, exists: sample.is_light() }
    }

    #[inline(always)]
    fn evaluate(&self, receiver: &Receiver<F::Scene>, sample: LightAddress) -> Evaluation {
        evaluate(self.flags, &receiver.vertex, &receiver.scene.light_at(sample))
    }

    #[inline(always)]
    fn target(&self, evaluation: &Evaluation) -> f32 {
        evaluation.target
    }

    #[inline(always)]
    fn value(&self, evaluation: &Evaluation) -> Vec3 {
        evaluation.value
    }

    #[inline(always)]
    fn visibility(&self, receiver: &Receiver<F::Scene>, evaluation: &Evaluation) -> Vec3 {
        transmittance(&receiver.scene, self.has(DI_TRANSMITTANCE), &evaluation.shadow)
    }

    #[inline(always)]
    fn visible_target(&self, evaluation: &Evaluation, visibility: Vec3) -> f32 {
        evaluation.visible_target(visibility, self.flags)
    }
}

/// The pixels of a combine. What has no place in a buffer is here by value: an optimiser of SPIR-V keeps a structure that
/// points to a variable, and not every device takes one.
pub(super) struct Neighbourhood<'a, F> {
    pub(super) light: Light<F>,
    pub(super) params: DiParams,
    pub(super) planes: Planes<'a>,
    /// The one that combines.
    pub(super) pixel: Pixel,
}

impl<F: Frames> Neighbourhood<'_, F> {
    #[inline(always)]
    fn pixel(&self, of: Source) -> Pixel {
        let p = &self.params;
        if !of.is_other {
            return self.pixel;
        }
        let elsewhere = self.light.is_elsewhere(of);
        let (camera, frame) = if elsewhere { (p.other_camera, p.other_frame) } else { (p.camera, p.frame) };
        let hit = self.planes.other_hits[of.pixel as usize];
        Pixel::new(&camera, self.light.flags, p.seed, frame, self.grid().at(of.pixel), hit)
    }
}

impl<F: Frames> Pixels for Neighbourhood<'_, F> {
    type Domain = Light<F>;
    type Packed = UVec4;
    const NO_SAMPLE: LightAddress = LightAddress::NONE;
    const NO_RESERVOIR: UVec4 = UVec4::ZERO;

    #[inline(always)]
    fn domain(&self) -> &Light<F> {
        &self.light
    }

    #[inline(always)]
    fn grid(&self) -> Grid {
        self.params.grid()
    }

    #[inline(always)]
    fn unpack(&self, packed: UVec4) -> Stored {
        Stored::unpack(packed)
    }

    #[inline(always)]
    fn pack(&self, stored: &Stored) -> UVec4 {
        stored.pack()
    }

    #[inline(always)]
    fn other(&self, pixel: u32) -> UVec4 {
        self.planes.others[pixel as usize]
    }

    #[inline(always)]
    fn sees(&self, pixel: Source) -> bool {
        self.pixel(pixel).hit.is_hit()
    }

    #[inline(always)]
    fn facet(&self, of: Source) -> Facet {
        let pixel = self.pixel(of);
        let point = pixel.point(&self.light.frames.scene(self.light.has(DI_OTHER_FRAME)));
        Facet { position: point.position, normal: point.normal, distance: pixel.hit.t }
    }

    #[inline(always)]
    fn reproject(&self, here: &Facet) -> Place {
        self.grid().project(&self.params.other_camera, here.position)
    }

    #[inline(always)]
    fn receiver(&self, of: Source) -> Receiver<F::Scene> {
        let scene = self.light.frames.scene(self.light.is_elsewhere(of));
        Receiver { vertex: self.pixel(of).vertex(&scene), scene }
    }
}
