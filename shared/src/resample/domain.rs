//! What resampling asks of a kind of sample: [`Domain`] says what a sample is and what a pixel makes of it, [`Reservoirs`] how pixels keep
//! samples, and [`Pixels`] where those of other pixels lie.
//!
//! A sample x of pixel i is shifted to pixel j: T(x), a sample of j's domain, with the Jacobian J of T at x (Lin et al. 2022,
//! "Generalized Resampled Importance Sampling", eq. 9). Everything that is compared about one sample is measured in the
//! domain of the pixel that it comes from: its target at j is `p_j(T(x)) J`, at i itself `p_i(x)`. In the ratios of MIS that
//! is the same as pulling all targets into the domain of the pixel that combines, because J is common to a sample's targets.
//! Its contribution there is `p_j(T(x)) J W`, W being the contribution weight that came with it.
//!
//! A shift from i to j has to be undone by the one from j to i, with the inverse Jacobian, and has to fail if that one would.
//! Forms of MIS that ask what a third pixel makes of a sample (`Mis::asks_for_third`)
//! are unbiased only if shifts compose, too: from i to j is from i to the pixel that combines, then on to j.
//!
//! The simplest domain: all pixels have the same numbers, and want different multiples of them.
//!
//! ```
#![doc = include_str!("line.rs")]
//!
//! let (here, there) = (Source { is_other: false, pixel: 0 }, Source { is_other: true, pixel: 2 });
//! let shifted = Line.shift(0.25, there, here, &1.0);
//! assert!(shifted.exists);
//! assert_eq!(Line.target(&Line.evaluate(&1.0, shifted.sample)) * shifted.jacobian, 0.25);
//! ```

use super::packed::Stored;
use super::reproject::{Grid, Place};
use super::similar::GBufferSurface;
use glam::Vec3;

/// A pixel whose reservoir is an input of a combine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// One of the others, not the pixel that combines.
    pub is_other: bool,
    /// Index of the pixel.
    pub pixel: u32,
}

/// A sample where it was shifted to.
#[derive(Clone, Copy, Debug)]
pub struct Shifted<S> {
    /// The sample there.
    pub sample: S,
    /// What an area of the domain that it comes from is there: finite, >= 0.
    pub jacobian: f32,
    /// Whether there is such a sample. If not, `sample` means nothing.
    pub exists: bool,
}

/// A kind of sample, and what pixels make of it.
pub trait Domain {
    /// A sample, as the pixel has it that chose it.
    type Sample: Copy;
    /// A pixel, ready to evaluate many samples.
    type Receiver;
    /// What a sample is at a receiver; its default fills places that nothing asks for.
    type Evaluation: Copy + Default;

    /// A sample of pixel `from` as pixel `to` has it, which is `receiver`.
    fn shift(&self, sample: Self::Sample, from: Source, to: Source, receiver: &Self::Receiver)
    -> Shifted<Self::Sample>;
    /// A sample at the receiver that it was shifted to.
    fn evaluate(&self, receiver: &Self::Receiver, sample: Self::Sample) -> Self::Evaluation;
    /// The target, without visibility: in [0, 2^60].
    fn target(&self, evaluation: &Self::Evaluation) -> f32;
    /// What the sample contributes by channel, without visibility: zero where the target is.
    fn value(&self, evaluation: &Self::Evaluation) -> Vec3;
    /// What of the contribution arrives, by channel in [0, 1]: what may take a ray to find out.
    fn visibility(&self, receiver: &Self::Receiver, evaluation: &Self::Evaluation) -> Vec3;
    /// The target of what arrives.
    fn visible_target(&self, evaluation: &Self::Evaluation, visibility: Vec3) -> f32;
}

/// How pixels keep samples, and how a pixel is made ready to evaluate them: all that merging asks, once it is known which reservoirs take
/// part.
pub trait Reservoirs {
    /// What the samples are, and how they are shifted.
    type Domain: Domain;
    /// A reservoir as it lies in a plane.
    type Packed: Copy;
    /// Fills places that nothing asks for.
    const NO_SAMPLE: SampleOf<Self>;
    /// Fills places that nothing asks for.
    const NO_RESERVOIR: Self::Packed;

    /// What samples are.
    fn domain(&self) -> &Self::Domain;
    /// A reservoir from its place.
    fn unpack(&self, packed: Self::Packed) -> Stored<SampleOf<Self>>;
    /// A reservoir for its place.
    fn pack(&self, stored: &Stored<SampleOf<Self>>) -> Self::Packed;
    /// A pixel that sees a surface, ready to evaluate samples.
    fn receiver(&self, pixel: Source) -> <Self::Domain as Domain>::Receiver;
    /// What is left of the confidence of another frame's reservoirs at the pixel that combines, in (0, 1], where that sees its surface
    /// otherwise than then: less, the more samples are worth that were chosen before. It must not depend on samples. All of it, if not implemented.
    #[inline(always)]
    fn kept(&self, own: &<Self::Domain as Domain>::Receiver) -> f32 {
        let _ = own;
        1.0
    }
}

/// The pixels whose reservoirs a combine takes, seen from the one that combines.
pub trait Pixels: Reservoirs {
    /// The image.
    fn grid(&self) -> Grid;
    /// The reservoir of one of the other pixels.
    fn other(&self, pixel: u32) -> Self::Packed;
    /// The surface that the combining pixel sees, as it was when the others saw it.
    fn own_surface(&self) -> GBufferSurface;
    /// Whether one of the other pixels sees a surface.
    fn sees(&self, at: [u32; 2]) -> bool;
    /// The surface that one of the other pixels sees.
    fn surface(&self, at: [u32; 2]) -> GBufferSurface;
    /// Where the others' frame has what the combining pixel sees; asked if that is another frame.
    fn reproject(&self, here: &GBufferSurface) -> Place;
}

/// The samples of reservoirs.
pub(crate) type SampleOf<R> = <<R as Reservoirs>::Domain as Domain>::Sample;

/// What makes a pixel ready to evaluate the samples of reservoirs.
pub(crate) type ReceiverOf<R> = <<R as Reservoirs>::Domain as Domain>::Receiver;

/// What the samples of reservoirs are at a receiver.
pub(crate) type EvaluationOf<R> = <<R as Reservoirs>::Domain as Domain>::Evaluation;
