//! Combining reservoirs in step.

use super::super::combine::{draws, neighbourhood, rules};
use super::super::domain::{Light, element};
use super::super::{DiParams, Flags, PackedReservoir, Planes, Stored, combine};
use super::Looking;
use super::evaluated::{Asked, Evaluated, Known, Waiting};
use crate::geometry::Hit;
use crate::lanes::{LANES, Lanes, Registers, Stage, fields};
use crate::resample::domain::{Pixels, Reservoirs, Source};
use crate::resample::merge::{self, Inputs, Neighbour, Others, Rules};
use crate::resample::mis::INPUTS;
use crate::resample::reproject::Place;
use crate::resample::similar::Facet;
use crate::scene::{Frames, LightAddress, SceneFrames, SceneView, Still};
use core::array::from_fn;
use glam::Vec3;

/// Samples at pixels that are evaluated together: what as many pixels as lanes ask for in pairwise MIS, and one pixel in every form.
const EVALUATED: usize = LANES * (3 * INPUTS - 2);
const _: () = assert!(INPUTS * INPUTS <= EVALUATED);

fields! {
    Places = Place { x: u32, y: u32, inside: bool }
    Facets = Facet { position: Vec3, normal: Vec3, distance: f32 }
    Neighbours = Neighbour { counts: bool, pixel: u32, near: bool }
}

/// [`combine`](super::super::combine()) of the pixels of a row from (x, y) on, in whose order the `reservoirs` are: first the pixels' own, then what becomes of
/// them. Forms of MIS that ask for something after the selection are combined one by one.
#[inline(always)]
pub fn combine_row<const COMPILED: u32>(
    frames: &SceneFrames<'_, COMPILED>,
    params: &DiParams,
    planes: &Planes<'_>,
    [x, y]: [u32; 2],
    reservoirs: &mut [PackedReservoir],
    registers: impl Registers,
) {
    let light = Light { frames: *frames, flags: params.flags.in_use(&frames.scene(false)) };
    if light.flags.form().asks_for_selected() {
        for (x, own) in (x..).zip(reservoirs) {
            *own = combine(*frames, params, planes, *own, [x, y]).0;
        }
        return;
    }
    let rules = rules(&light, params);
    let [this, other] = [frames.scene(false), frames.scene(light.has(Flags::OTHER_FRAME))];
    let row = Row { light, params, planes, rules, registers };
    let around = Around { light: Light { frames: Still(other), flags: light.flags }, params, planes, rules };
    let mut waiting = [(&this, params.view()), (&other, params.other_view())]
        .map(|(scene, view)| Waiting::new(scene, view, light.flags, registers));
    let mut work = Work {
        inputs: [merge::alone::<KnownReservoirs<'_, SceneFrames<'_, COMPILED>>>(Stored::EMPTY, 0); LANES],
        counts: [0; LANES],
        ends: [0; LANES],
        evaluated: [Evaluated::NONE; EVALUATED],
    };
    let pixels = LANES.min(EVALUATED / rules.most_evaluated());
    for (x, reservoirs) in (x..).step_by(pixels).zip(reservoirs.chunks_mut(pixels)) {
        row.combine(&around, [x, y], reservoirs, &mut waiting, &mut work);
    }
}

/// What some pixels of a row are combined in.
struct Work<'a, F: Frames> {
    inputs: [Inputs<KnownReservoirs<'a, F>>; LANES],
    /// How many inputs each pixel has.
    counts: [u32; LANES],
    /// Where what is evaluated for each pixel ends.
    ends: [usize; LANES],
    evaluated: [Evaluated; EVALUATED],
}

/// What the pixels of a row have in common.
struct Row<'a, R, F> {
    light: Light<F>,
    params: &'a DiParams,
    planes: &'a Planes<'a>,
    rules: Rules,
    registers: R,
}

impl<R: Registers, F: Frames + Copy> Row<'_, R, F> {
    /// Combines the pixels from (x, y) on. What waits are samples at pixels that combine, and at the others.
    #[inline(always)]
    fn combine<const COMPILED: u32>(
        &self,
        around: &Around<'_, COMPILED>,
        at: [u32; 2],
        reservoirs: &mut [PackedReservoir],
        waiting: &mut [Waiting<'_, R, COMPILED>; 2],
        work: &mut Work<'_, F>,
    ) {
        let first = self.params.grid().index(at);
        let hits: [Hit; LANES] = from_fn(|lane| element(self.planes.hits, first.wrapping_add(lane as u32)).unpack());
        let found = self.find(around, at, &hits[..reservoirs.len()]);
        self.evaluate(at, reservoirs, &hits, &found, waiting, work);
        self.merge(at, reservoirs, work);
    }

    /// Makes what was found inputs, and evaluates what they will be asked for.
    #[inline(always)]
    fn evaluate<const COMPILED: u32>(
        &self,
        [x, y]: [u32; 2],
        reservoirs: &mut [PackedReservoir],
        hits: &[Hit; LANES],
        found: &[Lanes<Neighbour>],
        [here, there]: &mut [Waiting<'_, R, COMPILED>; 2],
        Work { inputs, counts, ends, evaluated }: &mut Work<'_, F>,
    ) {
        let Self { light, planes, rules, .. } = *self;
        let grid = self.params.grid();
        let none = KnownReservoirs(Known::new(light, &[]));
        let mut end = 0;
        for (lane, own) in reservoirs.iter_mut().enumerate() {
            let (x, hit, inputs) = (x.wrapping_add(lane as u32), hits[lane], &mut inputs[lane]);
            let pixel = grid.index([x, y]);
            if !light.has(Flags::OTHER_FRAME) {
                *own = element(planes.others, pixel);
            }
            counts[lane] = 1;
            if hit.is_hit() {
                *inputs = merge::alone::<KnownReservoirs<'_, F>>(Stored::unpack(*own), pixel);
                for neighbour in found {
                    let reservoir = |pixel| Stored::unpack(element(planes.others, pixel));
                    counts[lane] =
                        merge::add::<KnownReservoirs<'_, F>>(&neighbour.get(lane), reservoir, inputs, counts[lane]);
                }
                merge::evaluated(&none, &rules, inputs, counts[lane], |sample, to, traced| {
                    if to.is_other {
                        let ([x, y], hit) = (grid.at(to.pixel), element(planes.other_hits, to.pixel).unpack());
                        there.add(Looking { x, y, hit }, Asked { sample, traced }, end, evaluated);
                    } else {
                        here.add(Looking { x, y, hit }, Asked { sample, traced }, end, evaluated);
                    }
                    end += 1;
                });
            }
            ends[lane] = end;
        }
        here.finish(evaluated);
        there.finish(evaluated);
    }

    /// Merges the inputs of each pixel; one alone stays as it is.
    #[inline(always)]
    fn merge(&self, [x, y]: [u32; 2], reservoirs: &mut [PackedReservoir], work: &mut Work<'_, F>) {
        let mut begin = 0;
        for (lane, own) in reservoirs.iter_mut().enumerate() {
            let (count, end) = (work.counts[lane], work.ends[lane]);
            if count > 1 {
                let known = KnownReservoirs(Known::new(self.light, &work.evaluated[begin..end]));
                let draws = draws(self.params, [x.wrapping_add(lane as u32), y]);
                let (stored, _) = merge::merge(&known, &self.rules, &mut work.inputs[lane], count, &draws);
                *own = stored.pack();
            }
            begin = end;
        }
    }

    /// The other reservoirs that take part, by n.
    #[inline(always)]
    fn find<const COMPILED: u32>(
        &self,
        around: &Around<'_, COMPILED>,
        [x, y]: [u32; 2],
        hits: &[Hit],
    ) -> [Lanes<Neighbour>; INPUTS - 1] {
        let mut found = [Lanes::all(Neighbour::NONE); INPUTS - 1];
        let mut looking = Lanes::ZERO;
        for (lane, &hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
            looking.set(lane, Looking { x: x.wrapping_add(lane as u32), y, hit });
        }
        if self.rules.others == Others::Unchanged {
            self.registers.run(&Unchanged(around), &looking, &mut found[0]);
            return found;
        }
        let mut centers = Centers { looking, here: Lanes::ZERO, center: Lanes::ZERO };
        self.registers.run(around, &looking, &mut centers);
        for n in self.rules.first_neighbour()..=self.rules.neighbours {
            self.registers.run(&Nth { around, n }, &centers, &mut found[n as usize]);
        }
        found
    }
}

/// Where pixels look around.
struct Centers {
    looking: Lanes<Looking>,
    /// What they see.
    here: Lanes<Facet>,
    center: Lanes<Place>,
}

/// Finds centers, in the scene of the others' frame.
struct Around<'a, const COMPILED: u32> {
    light: Light<Still<SceneView<'a, COMPILED>>>,
    params: &'a DiParams,
    planes: &'a Planes<'a>,
    rules: Rules,
}

impl<const COMPILED: u32> Stage for Around<'_, COMPILED> {
    type From = Lanes<Looking>;
    type To = Centers;

    #[inline(always)]
    fn run(&self, looking: &Lanes<Looking>, to: &mut Centers) {
        let (light, params, planes, rules) = (self.light, *self.params, *self.planes, self.rules);
        for lane in 0..LANES {
            let Looking { x, y, hit } = looking.get(lane);
            let pixels = neighbourhood(light, &params, &planes, params.view().of_hit([x, y], hit));
            let here = pixels.own_facet();
            to.looking.set(lane, Looking { x, y, hit });
            to.here.set(lane, here);
            to.center.set(lane, rules.center(&pixels, &here, [x, y]));
        }
    }
}

/// Finds the n-th neighbour of each pixel.
struct Nth<'a, const COMPILED: u32> {
    around: &'a Around<'a, COMPILED>,
    n: u32,
}

impl<const COMPILED: u32> Stage for Nth<'_, COMPILED> {
    type From = Centers;
    type To = Lanes<Neighbour>;

    #[inline(always)]
    fn run(&self, from: &Centers, to: &mut Lanes<Neighbour>) {
        let Around { light, rules, .. } = *self.around;
        let (params, planes) = (*self.around.params, *self.around.planes);
        for lane in 0..LANES {
            let Looking { x, y, hit } = from.looking.get(lane);
            let pixels = neighbourhood(light, &params, &planes, params.view().of_hit([x, y], hit));
            let words = draws(&params, [x, y]).places();
            to.set(lane, rules.neighbour(&pixels, &from.here.get(lane), from.center.get(lane), self.n, words));
        }
    }
}

/// Finds the pixel's own reservoir of another frame, where nothing has changed.
struct Unchanged<'a, const COMPILED: u32>(&'a Around<'a, COMPILED>);

impl<const COMPILED: u32> Stage for Unchanged<'_, COMPILED> {
    type From = Lanes<Looking>;
    type To = Lanes<Neighbour>;

    #[inline(always)]
    fn run(&self, looking: &Lanes<Looking>, to: &mut Lanes<Neighbour>) {
        let Around { light, rules, .. } = *self.0;
        let (params, planes) = (*self.0.params, *self.0.planes);
        for lane in 0..LANES {
            let Looking { x, y, hit } = looking.get(lane);
            let pixels = neighbourhood(light, &params, &planes, params.view().of_hit([x, y], hit));
            to.set(lane, rules.unchanged(&pixels, [x, y]));
        }
    }
}

/// Reservoirs whose samples were evaluated in the order in which they are asked for.
struct KnownReservoirs<'a, F>(Known<'a, F>);

impl<'a, F: Frames> Reservoirs for KnownReservoirs<'a, F> {
    type Domain = Known<'a, F>;
    type Packed = Stored;
    const NO_SAMPLE: LightAddress = LightAddress::NONE;
    const NO_RESERVOIR: Stored = Stored::EMPTY;

    #[inline(always)]
    fn domain(&self) -> &Known<'a, F> {
        &self.0
    }

    #[inline(always)]
    fn unpack(&self, stored: Stored) -> Stored {
        stored
    }

    #[inline(always)]
    fn pack(&self, stored: &Stored) -> Stored {
        *stored
    }

    #[inline(always)]
    fn receiver(&self, _pixel: Source) {}
}
