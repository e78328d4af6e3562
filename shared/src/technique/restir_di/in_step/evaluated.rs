//! Samples at pixels, evaluated in step before a pass asks for them.

use super::super::domain::Light;
use super::super::pixel::View;
use super::super::{Flags, evaluate, visible_target};
use crate::geometry::{Hit, Ray};
use crate::lanes::{LANES, Lanes, Registers, Stage, fields};
use crate::resample::domain::{Domain, Shifted, Source};
use crate::scene::{AddressedLights, Frames, LightAddress, SceneView};
use crate::transport::transmittance;
use core::cell::Cell;
use glam::Vec3;

/// A sample at the pixel (x, y), which sees `hit`.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) hit: Hit,
    pub(super) sample: LightAddress,
    /// Whether a ray finds out what of it arrives, where its target is above zero.
    pub(super) traced: bool,
}

/// What it sends there.
#[derive(Clone, Copy)]
struct Sent {
    value: Vec3,
    target: f32,
    shadow: Ray,
}

/// What a pass asks of it.
#[derive(Clone, Copy)]
pub(super) struct Evaluated {
    value: Vec3,
    target: f32,
    /// What the ray has found, if it was traced.
    visibility: Vec3,
}

impl Evaluated {
    pub(super) const NONE: Self = Self { value: Vec3::ZERO, target: 0.0, visibility: Vec3::ZERO };
}

fields! {
    ManyAsked = Asked { x: u32, y: u32, hit: Hit, sample: LightAddress, traced: bool }
    ManySent = Sent { value: Vec3, target: f32, shadow: Ray }
}

/// The samples at pixels of one frame that wait until there are as many as lanes.
pub(super) struct Waiting<'a, R, const COMPILED: u32> {
    evaluate: Evaluate<'a, COMPILED>,
    registers: R,
    asked: Lanes<Asked>,
    /// Where each one's evaluation belongs.
    places: [usize; LANES],
    count: usize,
    sent: Lanes<Sent>,
}

impl<'a, R: Registers, const COMPILED: u32> Waiting<'a, R, COMPILED> {
    #[inline(always)]
    pub(super) fn new(scene: &'a SceneView<'a, COMPILED>, view: View, flags: Flags, registers: R) -> Self {
        let evaluate = Evaluate { scene, view, flags };
        Self { evaluate, registers, asked: Lanes::ZERO, places: [0; LANES], count: 0, sent: Lanes::ZERO }
    }

    /// One more, whose evaluation will be the one at `place`, at the latest after [`Self::finish`].
    #[inline(always)]
    pub(super) fn add(&mut self, asked: Asked, place: usize, evaluated: &mut [Evaluated]) {
        self.asked.set(self.count, asked);
        self.places[self.count] = place;
        self.count += 1;
        if self.count == LANES {
            self.evaluate(evaluated);
        }
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
        self.registers.run(&self.evaluate, &self.asked, &mut self.sent);
        let Evaluate { scene, flags, .. } = self.evaluate;
        let through_glass = flags.contains(Flags::TRANSMITTANCE);
        let (sent, asked) = (&self.sent, &self.asked);
        let traced = |lane: usize| (lane < self.count) & asked.get(lane).traced & (sent.get(lane).target > 0.0);
        let traced = Lanes::from_fn(traced);
        let occluded = if through_glass {
            Lanes::all(false)
        } else {
            scene.occluded_each(&Lanes::from_fn(|lane| sent.get(lane).shadow), &traced)
        };
        for (lane, &place) in self.places[..self.count].iter().enumerate() {
            let Sent { value, target, shadow } = sent.get(lane);
            let visibility = if through_glass & traced.get(lane) {
                transmittance(scene, true, &shadow)
            } else if occluded.get(lane) {
                Vec3::ZERO
            } else {
                Vec3::ONE
            };
            evaluated[place] = Evaluated { value, target, visibility };
        }
        self.count = 0;
    }
}

/// Evaluates samples at pixels of a view.
struct Evaluate<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    view: View,
    flags: Flags,
}

impl<const COMPILED: u32> Stage for Evaluate<'_, COMPILED> {
    type From = Lanes<Asked>;
    type To = Lanes<Sent>;

    #[inline(always)]
    fn run(&self, asked: &Lanes<Asked>, sent: &mut Lanes<Sent>) {
        // copies, of which the compiler sees that nobody writes to them
        let (scene, view, flags) = (*self.scene, self.view, self.flags);
        for lane in 0..LANES {
            let Asked { x, y, hit, sample, .. } = asked.get(lane);
            let vertex = view.of_hit([x, y], hit).vertex(&scene);
            let e = evaluate(flags, &vertex, &scene.light_at(sample));
            sent.set(lane, Sent { value: e.value, target: e.target, shadow: e.shadow });
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
        let (first, others) = self.next.get().split_first().unwrap_or((&Evaluated::NONE, &[]));
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
