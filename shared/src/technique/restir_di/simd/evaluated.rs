//! Samples at pixels, evaluated by SIMD before a pass asks for them.

use super::super::domain::Light;
use super::super::pixel::View;
use super::super::{Flags, Sent, visible_target};
use super::Looking;
use super::read::{Look, LookUp, Sees};
use crate::geometry::Ray;
use crate::lanes::{LANES, LaneKernel, Lanes, SimdToken, soa};
use crate::resample::domain::{Domain, Shifted, Source};
use crate::scene::{AddressedLight, AddressedLights, Frames, LightAddress, SceneView, Surface};
use crate::transport::{Vertex, transmittance};
use core::cell::Cell;
use glam::Vec3;

/// A sample at a pixel.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub(super) sample: LightAddress,
    /// Whether a ray finds out what of it arrives, where its target is above zero.
    pub(super) traced: bool,
}

/// What a pass asks of it.
#[derive(Clone, Copy, Default)]
pub(super) struct Evaluated {
    value: Vec3,
    target: f32,
    /// What the ray has found, if it was traced.
    visibility: Vec3,
}

impl Evaluated {
    pub(super) const NONE: Self = Self { value: Vec3::ZERO, target: 0.0, visibility: Vec3::ZERO };
}

soa! {
    ManyAsked = Asked { sample: LightAddress, traced: bool }
    ManySent = Sent { value: Vec3, target: f32, shadow: Ray }
}

/// Stands for the place of no sample.
const NOWHERE: usize = usize::MAX;

/// Samples of one pixel that share its lane. (With four the stage is so long that LLVM does not vectorise it.)
const SAMPLES: usize = 2;
const _: () = assert!(SAMPLES == 2, "the stage names each");

/// Samples at pixels of one frame that wait until there are as many pixels as lanes. Of those that follow each other at one pixel, [`SAMPLES`] share
/// its lane, so that what is seen there is looked at once.
pub(super) struct Waiting<'a, R, const COMPILED: u32> {
    evaluate: Evaluate<'a, R, COMPILED>,
    questions: Questions,
    /// Where each one's evaluation belongs, or [`NOWHERE`].
    places: [[usize; SAMPLES]; LANES],
    /// Lanes in use.
    count: usize,
    /// Samples in the last of them.
    of_last: usize,
    sent: [Lanes<Sent>; SAMPLES],
}

/// Pixels, and samples to evaluate there.
struct Questions {
    looking: Lanes<Looking>,
    asked: [Lanes<Asked>; SAMPLES],
    /// What the pixels see and what lies at the samples, where reading it is a stage.
    sees: Sees,
    lights: [Lanes<AddressedLight>; SAMPLES],
}

impl<'a, R: SimdToken, const COMPILED: u32> Waiting<'a, R, COMPILED> {
    #[inline(always)]
    pub(super) fn new(scene: &'a SceneView<'a, COMPILED>, view: View, flags: Flags, token: R) -> Self {
        Self {
            evaluate: Evaluate { look: Look { scene, view }, flags, token },
            questions: Questions {
                looking: Lanes::ZERO,
                asked: [Lanes::ZERO; SAMPLES],
                sees: Sees::ZERO,
                lights: [Lanes::ZERO; SAMPLES],
            },
            places: [[NOWHERE; SAMPLES]; LANES],
            count: 0,
            of_last: SAMPLES,
            sent: [Lanes::ZERO; SAMPLES],
        }
    }

    /// One more, whose evaluation will be the one at `place`, at the latest after [`Self::finish`].
    #[inline(always)]
    pub(super) fn add(&mut self, looking: Looking, asked: Asked, place: usize, evaluated: &mut [Evaluated]) {
        let last = self.questions.looking.get(self.count.wrapping_sub(1) % LANES);
        if self.of_last == SAMPLES || [last.x, last.y] != [looking.x, looking.y] {
            if self.count == LANES {
                self.evaluate(evaluated);
            }
            self.questions.looking.set(self.count, looking);
            self.places[self.count] = [NOWHERE; SAMPLES];
            (self.count, self.of_last) = (self.count + 1, 0);
        }
        let lane = self.count - 1;
        self.questions.asked[self.of_last].set(lane, asked);
        self.places[lane][self.of_last] = place;
        self.of_last += 1;
    }

    /// Evaluates those that are left.
    #[inline(always)]
    pub(super) fn finish(&mut self, evaluated: &mut [Evaluated]) {
        if self.count > 0 {
            self.evaluate(evaluated);
        }
    }

    #[inline(never)]
    fn evaluate(&mut self, evaluated: &mut [Evaluated]) {
        if !R::GATHERS {
            self.questions.read(&self.evaluate);
        }
        self.evaluate.token.run(&self.evaluate, &self.questions, &mut self.sent);
        for sample in 0..SAMPLES {
            self.trace(sample, evaluated);
        }
        (self.count, self.of_last) = (0, SAMPLES);
    }

    /// Traces the rays of the samples of that index, one of each pixel.
    #[inline(always)]
    fn trace(&self, sample: usize, evaluated: &mut [Evaluated]) {
        let Evaluate { look: Look { scene, .. }, flags, .. } = self.evaluate;
        let through_glass = flags.contains(Flags::TRANSMITTANCE);
        let (asked, sent) = (&self.questions.asked[sample], &self.sent[sample]);
        let is_asked = |lane: usize| (lane < self.count) & (self.places[lane][sample] != NOWHERE);
        let traced = Lanes::from_fn(|lane| is_asked(lane) & asked.get(lane).traced & (sent.get(lane).target > 0.0));
        let occluded = if through_glass {
            Lanes::all(false)
        } else {
            scene.occluded_each(&Lanes::from_fn(|lane| sent.get(lane).shadow), &traced)
        };
        for lane in (0..self.count).filter(|&lane| is_asked(lane)) {
            let Sent { value, target, shadow } = sent.get(lane);
            let visibility = if through_glass & traced.get(lane) {
                transmittance(scene, true, &shadow)
            } else if occluded.get(lane) {
                Vec3::ZERO
            } else {
                Vec3::ONE
            };
            evaluated[self.places[lane][sample]] = Evaluated { value, target, visibility };
        }
    }
}

impl Questions {
    /// Looks at the pixels, and at what lies at the samples.
    #[inline(always)]
    fn read<R: SimdToken, const COMPILED: u32>(&mut self, evaluate: &Evaluate<'_, R, COMPILED>) {
        let Evaluate { look, token, .. } = evaluate;
        token.run(look, &self.looking, &mut self.sees);
        for (asked, lights) in self.asked.iter().zip(&mut self.lights) {
            token.run(&LookUp(look.scene), &Lanes::from_fn(|lane| asked.get(lane).sample), lights);
        }
    }
}

/// Evaluates samples at pixels of a view.
struct Evaluate<'a, R, const COMPILED: u32> {
    look: Look<'a, COMPILED>,
    flags: Flags,
    token: R,
}

impl<R: SimdToken, const COMPILED: u32> LaneKernel for Evaluate<'_, R, COMPILED> {
    type In = Questions;
    type Out = [Lanes<Sent>; SAMPLES];

    #[inline(always)]
    fn run(&self, from: &Questions, sent: &mut [Lanes<Sent>; SAMPLES]) {
        // copies, of which the compiler sees that nobody writes to them
        let (scene, view, flags) = (*self.look.scene, self.look.view, self.flags);
        for lane in 0..LANES {
            let (vertex, lights) = if R::GATHERS {
                let Looking { x, y, hit } = from.looking.get(lane);
                let at = |sample: &Lanes<Asked>| scene.light_at(sample.get(lane).sample);
                (view.of_hit([x, y], hit).vertex(&scene), [at(&from.asked[0]), at(&from.asked[1])])
            } else {
                let vertex = Vertex::new(&from.sees.point.get(lane), &from.sees.ray.get(lane), scene.features());
                (vertex, [from.lights[0].get(lane), from.lights[1].get(lane)])
            };
            // one after the other: a loop would keep compilers from vectorising
            sent[0].set(lane, Sent::of(flags, &vertex, &lights[0]));
            sent[1].set(lane, Sent::of(flags, &vertex, &lights[1]));
        }
    }
}

/// Light whose samples were evaluated in the order in which they are asked for.
pub(super) struct Known<'a, F> {
    light: Light<F>,
    next: Cell<&'a [Evaluated]>,
}

impl<'a, F> Known<'a, F> {
    #[inline(always)]
    pub(super) fn new(light: Light<F>, evaluated: &'a [Evaluated]) -> Self {
        Self { light, next: Cell::new(evaluated) }
    }

    /// Whether all that was evaluated has been asked for.
    pub(super) fn is_done(&self) -> bool {
        self.next.get().is_empty()
    }
}

impl<F: Frames> Domain for Known<'_, F> {
    type Sample = LightAddress;
    type Receiver = ();
    type Evaluation = Evaluated;

    #[inline(always)]
    fn shift(&self, sample: LightAddress, from: Source, to: Source, (): &()) -> Shifted<LightAddress> {
        self.light.shifted(sample, from, to)
    }

    #[inline(always)]
    fn evaluate(&self, (): &(), _sample: LightAddress) -> Evaluated {
        let next = self.next.get();
        debug_assert!(!next.is_empty(), "more is asked for than was listed");
        let (first, others) = next.split_first().unwrap_or((&Evaluated::NONE, &[]));
        self.next.set(others);
        *first
    }

    #[inline(always)]
    fn target(&self, evaluated: &Evaluated) -> f32 {
        evaluated.target
    }

    #[inline(always)]
    fn value(&self, evaluated: &Evaluated) -> Vec3 {
        evaluated.value
    }

    #[inline(always)]
    fn visibility(&self, (): &(), evaluated: &Evaluated) -> Vec3 {
        evaluated.visibility
    }

    #[inline(always)]
    fn visible_target(&self, evaluated: &Evaluated, visibility: Vec3) -> f32 {
        visible_target(evaluated.value, evaluated.target, visibility, self.light.flags)
    }
}
