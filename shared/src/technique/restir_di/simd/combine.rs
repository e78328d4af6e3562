//! Combining reservoirs by SIMD.

use super::super::combine::{draws, neighbourhood, rules};
use super::super::domain::Light;
use super::super::{DiParams, Flags, PackedReservoir, Planes, Stored, combine};
use super::Looking;
use super::evaluated::{Asked, Evaluated, Known, Waiting};
use crate::geometry::Hit;
use crate::lanes::{LANES, LaneKernel, Lanes, SimdToken, soa};
use crate::layout::FEATURE_GLOSSY;
use crate::resample::domain::{Pixels, Reservoirs, Source};
use crate::resample::matrix;
use crate::resample::merge::{self, Inputs, Neighbour, Others, Rules};
use crate::resample::mis::INPUTS;
use crate::resample::reproject::Place;
use crate::resample::similar::GBufferSurface;
use crate::scene::{Frames, LightAddress, SceneFrames, SceneView, Still, Surface};
use glam::Vec3;

/// Samples at pixels that are evaluated together: what as many pixels as lanes ask for in pairwise MIS, and one pixel in every form.
const EVALUATED: usize = LANES * (3 * INPUTS - 2);
const _: () = assert!(INPUTS * INPUTS <= EVALUATED);

soa! {
    Places = Place { x: u32, y: u32, inside: bool }
    GBufferSurfaces = GBufferSurface { position: Vec3, normal: Vec3, distance: f32 }
    Neighbours = Neighbour { counts: bool, pixel: u32, near: bool }
}

/// [`combine`](super::super::combine()) of the pixels of a row from (x, y) on, in whose order the `reservoirs` are. With the last frame they are the pixels' own at
/// first; with neighbours of the same frame they have no effect. At last they are what was combined. Forms of MIS that ask for something after the
/// selection are combined one by one.
///
/// # Panics
/// If a plane has fewer elements than the image has pixels.
#[inline(always)]
pub fn combine_row<const COMPILED: u32>(
    frames: &SceneFrames<'_, COMPILED>,
    params: &DiParams,
    planes: &Planes<'_>,
    [x, y]: [u32; 2],
    reservoirs: &mut [PackedReservoir],
    token: impl SimdToken,
) {
    let light = Light { frames: *frames, flags: params.flags.in_use(&frames.scene(false)) };
    if light.flags.form().asks_for_selected() {
        for (x, own) in (x..).zip(reservoirs) {
            *own = combine(*frames, params, planes, *own, [x, y]).reservoir;
        }
        return;
    }
    planes.check(params.grid());
    let rules = rules(&light, params);
    let [this, other] = [frames.scene(false), frames.scene(light.has(Flags::OTHER_FRAME))];
    let around = Around { light: Light { frames: Still(other), flags: light.flags }, params, planes, rules };
    let row = Row { light, around, token };
    let mut waiting = [(&this, params.view()), (&other, params.other_view())]
        .map(|(scene, view)| Waiting::new(scene, view, light.flags, token));
    let mut work = Work {
        inputs: [merge::alone::<KnownReservoirs<'_, COMPILED>>(Stored::EMPTY, 0); LANES],
        kept: Lanes::all(1.0),
        counts: [0; LANES],
        ends: [0; LANES],
        evaluated: [Evaluated::NONE; EVALUATED],
    };
    let pixels = LANES.min(EVALUATED / rules.most_evaluated());
    for (x, reservoirs) in (x..).step_by(pixels).zip(reservoirs.chunks_mut(pixels)) {
        row.combine([x, y], reservoirs, &mut waiting, &mut work);
    }
}

/// What some pixels of a row are combined in.
struct Work<'a, const COMPILED: u32> {
    inputs: [Inputs<KnownReservoirs<'a, COMPILED>>; LANES],
    /// What each pixel leaves of the confidence of another frame's reservoirs.
    kept: Lanes<f32>,
    /// How many inputs each pixel has.
    counts: [u32; LANES],
    /// Where what is evaluated for each pixel ends.
    ends: [usize; LANES],
    evaluated: [Evaluated; EVALUATED],
}

/// What the pixels of a row have in common.
struct Row<'a, R, const COMPILED: u32> {
    light: Light<SceneFrames<'a, COMPILED>>,
    around: Around<'a, COMPILED>,
    token: R,
}

impl<'a, R: SimdToken, const COMPILED: u32> Row<'a, R, COMPILED> {
    /// Combines the pixels from (x, y) on. What waits are samples at pixels that combine, and at the others.
    #[inline(always)]
    fn combine(
        &self,
        at: [u32; 2],
        reservoirs: &mut [PackedReservoir],
        waiting: &mut [Waiting<'_, R, COMPILED>; 2],
        work: &mut Work<'a, COMPILED>,
    ) {
        let first = self.around.params.grid().index(at) as usize;
        let mut hits = [Hit::MISS; LANES];
        let seen = &self.around.planes.hits[first..first + reservoirs.len()];
        hits.iter_mut().zip(seen).for_each(|(hit, seen)| *hit = seen.unpack());
        let looking = looking(at, &hits);
        let found = self.find(&looking, &hits);
        if self.around.rules.others == Others::OtherFrame {
            self.fade(&looking, &mut work.kept);
        }
        self.evaluate(at, reservoirs, &hits, &found, waiting, work);
        self.merge(at, reservoirs, work);
    }

    /// Makes what was found inputs, and evaluates what they will be asked for.
    #[inline(always)]
    fn evaluate(
        &self,
        [x, y]: [u32; 2],
        reservoirs: &mut [PackedReservoir],
        hits: &[Hit; LANES],
        found: &[Lanes<Neighbour>],
        [here, there]: &mut [Waiting<'_, R, COMPILED>; 2],
        Work { inputs, counts, ends, evaluated, .. }: &mut Work<'a, COMPILED>,
    ) {
        let Around { params, planes, rules, .. } = self.around;
        let grid = params.grid();
        let none = KnownReservoirs { known: Known::new(self.light, &[]), kept: 1.0 };
        let mut end = 0;
        for (lane, own) in reservoirs.iter_mut().enumerate() {
            let (x, hit, inputs) = (x.wrapping_add(lane as u32), hits[lane], &mut inputs[lane]);
            let pixel = grid.index([x, y]);
            if rules.others == Others::SameFrame {
                *own = planes.others[pixel as usize];
            }
            counts[lane] = 1;
            if hit.is_hit() {
                *inputs = merge::alone::<KnownReservoirs<'_, COMPILED>>(Stored::unpack(*own), pixel);
                for neighbour in found {
                    let reservoir = |pixel: u32| Stored::unpack(planes.others[pixel as usize]);
                    counts[lane] = merge::add::<KnownReservoirs<'_, COMPILED>>(
                        &neighbour.get(lane),
                        reservoir,
                        inputs,
                        counts[lane],
                    );
                }
                matrix::evaluated(&none, &rules, inputs, counts[lane], |sample, to, traced| {
                    if to.is_other {
                        let ([x, y], hit) = (grid.at(to.pixel), planes.other_hits[to.pixel as usize].unpack());
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
    fn merge(&self, [x, y]: [u32; 2], reservoirs: &mut [PackedReservoir], work: &mut Work<'a, COMPILED>) {
        let Around { params, rules, .. } = self.around;
        let mut begin = 0;
        for (lane, own) in reservoirs.iter_mut().enumerate() {
            let (count, end) = (work.counts[lane], work.ends[lane]);
            if count > 1 {
                let known = Known::new(self.light, &work.evaluated[begin..end]);
                let known = KnownReservoirs { known, kept: work.kept.get(lane) };
                let draws = draws(params, [x.wrapping_add(lane as u32), y]);
                let stored = matrix::merge(&known, &rules, &mut work.inputs[lane], count, &draws).reservoir;
                debug_assert!(known.known.is_done(), "less is asked for than was listed");
                *own = stored.pack();
            }
            begin = end;
        }
    }

    /// What the pixels leave of the confidence of another frame's reservoirs.
    #[inline(always)]
    fn fade(&self, looking: &Lanes<Looking>, kept: &mut Lanes<f32>) {
        let scene = self.light.frames.scene(false);
        if scene.features() & FEATURE_GLOSSY != 0 {
            self.token.run(&Fade { scene: &scene, params: self.around.params }, looking, kept);
        }
    }

    /// The other reservoirs that take part, by n.
    #[inline(always)]
    fn find(&self, looking: &Lanes<Looking>, hits: &[Hit; LANES]) -> [Lanes<Neighbour>; INPUTS] {
        let Around { light, params, planes, rules } = self.around;
        let mut found = [Lanes::all(Neighbour::NONE); INPUTS];
        if !hits.iter().any(Hit::is_hit) {
            return found;
        }
        if rules.others == Others::Unchanged {
            for lane in (0..LANES).filter(|&lane| hits[lane].is_hit()) {
                let Looking { x, y, hit } = looking.get(lane);
                let at = [x, y];
                let pixels = neighbourhood(light, params, planes, params.view().of_hit(at, hit));
                found[0].set(lane, rules.unchanged(&pixels, at));
            }
            return found;
        }
        let mut centers = Centers { looking: *looking, here: Lanes::ZERO, center: Lanes::ZERO };
        self.token.run(&self.around, looking, &mut centers);
        for n in rules.first_neighbour()..=rules.neighbours {
            self.token.run(&Nth { around: &self.around, n }, &centers, &mut found[n as usize]);
        }
        found
    }
}

/// The pixels from (x, y) on; what stands for those that see nothing is never looked up.
#[inline(always)]
fn looking([x, y]: [u32; 2], hits: &[Hit; LANES]) -> Lanes<Looking> {
    let mut looking = Lanes::ZERO;
    for (lane, &hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
        looking.set(lane, Looking { x: x.wrapping_add(lane as u32), y, hit });
    }
    looking
}

/// Finds what is left of the confidence of another frame's reservoirs.
struct Fade<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a DiParams,
}

impl<const COMPILED: u32> LaneKernel for Fade<'_, COMPILED> {
    type In = Lanes<Looking>;
    type Out = Lanes<f32>;

    #[inline(always)]
    fn run(&self, looking: &Lanes<Looking>, to: &mut Lanes<f32>) {
        let (scene, params) = (*self.scene, *self.params);
        for lane in 0..LANES {
            let Looking { x, y, hit } = looking.get(lane);
            let pixel = params.view().of_hit([x, y], hit);
            to.set(lane, pixel.kept(params.gloss_fade, pixel.vertex(&scene).bsdf.gloss(), &params.other_view()));
        }
    }
}

/// Where pixels look around.
struct Centers {
    looking: Lanes<Looking>,
    /// What they see.
    here: Lanes<GBufferSurface>,
    center: Lanes<Place>,
}

/// Finds centers, in the scene of the others' frame.
#[derive(Clone, Copy)]
struct Around<'a, const COMPILED: u32> {
    light: Light<Still<SceneView<'a, COMPILED>>>,
    params: &'a DiParams,
    planes: &'a Planes<'a>,
    rules: Rules,
}

impl<const COMPILED: u32> LaneKernel for Around<'_, COMPILED> {
    type In = Lanes<Looking>;
    type Out = Centers;

    #[inline(always)]
    fn run(&self, looking: &Lanes<Looking>, to: &mut Centers) {
        let (light, params, planes, rules) = (self.light, *self.params, *self.planes, self.rules);
        for lane in 0..LANES {
            let Looking { x, y, hit } = looking.get(lane);
            let pixels = neighbourhood(light, &params, &planes, params.view().of_hit([x, y], hit));
            let here = pixels.own_surface();
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

impl<const COMPILED: u32> LaneKernel for Nth<'_, COMPILED> {
    type In = Centers;
    type Out = Lanes<Neighbour>;

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

/// Reservoirs whose samples were evaluated in the order in which they are asked for.
struct KnownReservoirs<'a, const COMPILED: u32> {
    known: Known<'a, SceneFrames<'a, COMPILED>>,
    /// What the pixel leaves of the confidence of another frame's reservoirs.
    kept: f32,
}

impl<'a, const COMPILED: u32> Reservoirs for KnownReservoirs<'a, COMPILED> {
    type Domain = Known<'a, SceneFrames<'a, COMPILED>>;
    type Packed = Stored;
    const NO_SAMPLE: LightAddress = LightAddress::NONE;
    const NO_RESERVOIR: Stored = Stored::EMPTY;

    #[inline(always)]
    fn domain(&self) -> &Known<'a, SceneFrames<'a, COMPILED>> {
        &self.known
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

    #[inline(always)]
    fn kept(&self, (): &()) -> f32 {
        self.kept
    }
}
