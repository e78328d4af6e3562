//! What samples are: addresses of lights, which move between pixels and frames with a Jacobian of 1.

use super::pixel::{Pixel, View};
use super::{Flags, PackedReservoir, Planes, Sent, Stored, visible_target};
use crate::bsdf::ScatteringFunction;
use crate::pack::element;
use crate::resample::domain::{Domain, Pixels, Reservoirs, Shifted, Source};
use crate::resample::reproject::{Grid, Place};
use crate::resample::similar::GBufferSurface;
use crate::scene::{AddressedLights, BsdfOf, Frames, LightAddress};
use crate::transport::{Vertex, transmittance};
use glam::{UVec4, Vec3};

/// Light at pixels of one frame or two.
#[derive(Clone, Copy)]
pub(super) struct Light<F> {
    pub(super) frames: F,
    pub(super) flags: Flags,
}

/// A pixel that light is brought to, and whether it is of the other frame. The scene of its frame is asked for anew where it is
/// needed: kept beside the vertex it would have to lie in memory as that does.
pub(super) struct Receiver<B> {
    pub(super) vertex: Vertex<B>,
    pub(super) elsewhere: bool,
}

impl<F> Light<F> {
    #[inline(always)]
    pub(super) fn has(&self, flag: Flags) -> bool {
        self.flags.contains(flag)
    }

    /// Whether what a reservoir keeps of a visibility is not good enough for MIS: it has a colour.
    #[inline(always)]
    pub(super) fn forgets(&self) -> bool {
        self.has(Flags::MIS_VISIBILITY) & self.has(Flags::TRANSMITTANCE)
    }

    /// Whether a pixel is of another frame.
    #[inline(always)]
    fn is_elsewhere(&self, pixel: Source) -> bool {
        self.has(Flags::OTHER_FRAME) & pixel.is_other
    }
}

impl<F: Frames> Light<F> {
    /// [`Domain::shift`], which asks nothing of the receiver.
    #[inline(always)]
    pub(super) fn shifted(&self, sample: LightAddress, from: Source, to: Source) -> Shifted<LightAddress> {
        let of_other = self.is_elsewhere(from);
        let sample = if of_other == self.is_elsewhere(to) { sample } else { self.frames.counterpart(sample, of_other) };
        Shifted { sample, jacobian: 1.0, exists: sample.is_light() }
    }
}

impl<F: Frames> Domain for Light<F> {
    type Sample = LightAddress;
    type Receiver = Receiver<BsdfOf<F::Scene>>;
    type Evaluation = Sent;

    #[inline(always)]
    fn shift(
        &self,
        sample: LightAddress,
        from: Source,
        to: Source,
        _receiver: &Self::Receiver,
    ) -> Shifted<LightAddress> {
        self.shifted(sample, from, to)
    }

    #[inline(always)]
    fn evaluate(&self, receiver: &Self::Receiver, sample: LightAddress) -> Sent {
        Sent::of(self.flags, &receiver.vertex, &self.frames.scene(receiver.elsewhere).light_at(sample))
    }

    #[inline(always)]
    fn target(&self, evaluation: &Sent) -> f32 {
        evaluation.target
    }

    #[inline(always)]
    fn value(&self, evaluation: &Sent) -> Vec3 {
        evaluation.value
    }

    #[inline(always)]
    fn visibility(&self, receiver: &Self::Receiver, evaluation: &Sent) -> Vec3 {
        transmittance(&self.frames.scene(receiver.elsewhere), self.has(Flags::TRANSMITTANCE), &evaluation.shadow)
    }

    #[inline(always)]
    fn visible_target(&self, evaluation: &Sent, visibility: Vec3) -> f32 {
        visible_target(evaluation.value, evaluation.target, visibility, self.flags)
    }
}

/// The pixels of a combine. What has no place in a buffer is here by value: an optimiser of SPIR-V keeps a structure that
/// points to a variable, and not every device takes one.
pub(super) struct Neighbourhood<'a, F> {
    pub(super) light: Light<F>,
    pub(super) planes: Planes<'a>,
    pub(super) grid: Grid,
    /// The one that combines.
    pub(super) pixel: Pixel,
    /// The others' view.
    pub(super) view: View,
    /// [`super::DiParams::gloss_fade`].
    pub(super) gloss_fade: f32,
}

impl<F: Frames> Neighbourhood<'_, F> {
    /// One of the others.
    #[inline(always)]
    fn pixel(&self, at: [u32; 2]) -> Pixel {
        self.view.pixel(at, element(self.planes.other_hits, self.grid.index(at) as usize))
    }

    /// What a pixel sees, in the scene of the others' frame.
    #[inline(always)]
    fn surface_of(&self, pixel: &Pixel) -> GBufferSurface {
        let point = pixel.point(&self.light.frames.scene(self.light.has(Flags::OTHER_FRAME)));
        GBufferSurface { position: point.position, normal: point.normal, distance: pixel.hit.t }
    }
}

impl<F: Frames> Reservoirs for Neighbourhood<'_, F> {
    type Domain = Light<F>;
    type Packed = PackedReservoir;
    // zeros, which cost least to write
    const NO_SAMPLE: LightAddress = LightAddress { light: 0, u: 0, v: 0 };
    const NO_RESERVOIR: PackedReservoir = PackedReservoir(UVec4::ZERO);

    #[inline(always)]
    fn domain(&self) -> &Light<F> {
        &self.light
    }

    #[inline(always)]
    fn unpack(&self, packed: PackedReservoir) -> Stored {
        Stored::unpack(packed)
    }

    #[inline(always)]
    fn pack(&self, stored: &Stored) -> PackedReservoir {
        stored.pack()
    }

    #[inline(always)]
    fn receiver(&self, of: Source) -> Receiver<BsdfOf<F::Scene>> {
        let elsewhere = self.light.is_elsewhere(of);
        let pixel = if of.is_other { self.pixel(self.grid.at(of.pixel)) } else { self.pixel };
        Receiver { vertex: pixel.vertex(&self.light.frames.scene(elsewhere)), elsewhere }
    }

    #[inline(always)]
    fn kept(&self, own: &Receiver<BsdfOf<F::Scene>>) -> f32 {
        self.pixel.kept(self.gloss_fade, own.vertex.bsdf.gloss(), &self.view)
    }
}

impl<F: Frames> Pixels for Neighbourhood<'_, F> {
    #[inline(always)]
    fn grid(&self) -> Grid {
        self.grid
    }

    #[inline(always)]
    fn other(&self, pixel: u32) -> PackedReservoir {
        element(self.planes.others, pixel as usize)
    }

    #[inline(always)]
    fn own_surface(&self) -> GBufferSurface {
        self.surface_of(&self.pixel)
    }

    #[inline(always)]
    fn sees(&self, at: [u32; 2]) -> bool {
        self.pixel(at).hit.is_hit()
    }

    #[inline(always)]
    fn surface(&self, at: [u32; 2]) -> GBufferSurface {
        self.surface_of(&self.pixel(at))
    }

    #[inline(always)]
    fn reproject(&self, here: &GBufferSurface) -> Place {
        self.grid.project(&self.view.camera, here.position)
    }
}
