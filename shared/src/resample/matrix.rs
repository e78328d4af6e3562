//! The matrix of a combine: what each sample of its inputs is at each pixel, as far as a form of MIS asks for it, and the choice of one sample.

use super::domain::{Domain, EvaluationOf, ReceiverOf, Reservoirs, SampleOf, Shifted, Source};
use super::merge::{Combined, Draws, Input, Inputs, Others, Rules};
use super::mis::{Combine, INPUTS};
use super::packed::{Stored, dithered};
use super::reservoir::Reservoir;
use crate::num::{self, Scalar};
use crate::rng;
use glam::Vec3;

/// An entry of the matrix: the sample of input `i` at the receiver of a row.
struct Entry<S> {
    row: u32,
    /// The input whose pixel receives.
    receiving: u32,
    i: u32,
    /// The reservoir of the sample.
    stored: Stored<S>,
    /// It is asked for since the sample has been selected.
    is_selected: bool,
    /// A ray finds its visibility, if its target is above zero.
    traced: bool,
}

impl<S> Entry<S> {
    /// The entry in `row`, whose receiver is the input `receiving`, of the sample of input i.
    #[inline(always)]
    fn new<R: Reservoirs<Domain: Domain<Sample = S>>>(
        reservoirs: &R,
        rules: &Rules,
        [row, receiving, i]: [u32; 3],
        inputs: &Inputs<R>,
        selected: u32,
    ) -> Self {
        let Input { reservoir, near, .. } = inputs[i as usize];
        Self {
            row,
            receiving,
            i,
            stored: reservoirs.unpack(reservoir),
            is_selected: rules.form.asks_for_selected() & (row > 0) & (i == selected),
            traced: rules.traces(row, receiving, i, near),
        }
    }
}

/// What is done on the way through the matrix. Reservoirs and rules are arguments and no fields: an optimiser of SPIR-V keeps a structure
/// that points to a variable, and not every device takes one.
trait Visit<R: Reservoirs> {
    /// The input that has been selected, once there is one.
    fn selected(&self) -> u32;
    /// A row begins.
    #[inline(always)]
    fn begin(&mut self, _reservoirs: &R, _rules: &Rules, _row: u32, _receiver: &ReceiverOf<R>) {}
    /// An entry of it, and its sample at the receiver, if that is wanted and exists.
    fn evaluate(
        &mut self,
        reservoirs: &R,
        entry: &Entry<SampleOf<R>>,
        shifted: &Shifted<SampleOf<R>>,
        receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    );
    /// An entry of it, after all have been evaluated.
    #[inline(always)]
    fn weigh(
        &mut self,
        _reservoirs: &R,
        _rules: &Rules,
        _entry: &Entry<SampleOf<R>>,
        _receiver: &ReceiverOf<R>,
        _inputs: &mut Inputs<R>,
    ) {
    }
    /// All its entries have been weighed.
    #[inline(always)]
    fn end(&mut self, _rules: &Rules, _row: u32, _inputs: &Inputs<R>, _count: u32) {}
}

/// The walk through the matrix: row by row, so that each receiver is made once. Its order is the one in which samples are evaluated, whether
/// they are merged or listed. A row's rays are traced after all its samples have been evaluated, so that no surface takes registers of a GPU
/// while rays are traced. The loops test at their end, as there is at least one row and one input: of a loop that tests first, a compiler
/// keeps twice what it hands on.
#[inline(always)]
fn walk<R: Reservoirs, V: Visit<R>>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    visitor: &mut V,
) {
    let rows = rules.rows(count);
    let mut row = 0;
    loop {
        let receiving = if row == count { 0 } else { row };
        let to = Source { is_other: receiving != 0, pixel: inputs[receiving as usize].pixel };
        let receiver = reservoirs.receiver(to);
        visitor.begin(reservoirs, rules, row, &receiver);
        let mut i = 0_u32;
        loop {
            let entry = Entry::new(reservoirs, rules, [row, receiving, i], inputs, visitor.selected());
            let from = Source { is_other: i != 0, pixel: inputs[i as usize].pixel };
            let shifted = reservoirs.domain().shift(entry.stored.sample, from, to, &receiver);
            let wanted = entry.is_selected | rules.wants(row, receiving, i);
            let exists = wanted & (entry.stored.contribution_weight > 0.0) & shifted.exists;
            visitor.evaluate(reservoirs, &entry, &Shifted { exists, ..shifted }, &receiver, inputs);
            i = i.wrapping_add(1);
            if i >= count {
                break;
            }
        }
        i = 0;
        loop {
            let entry = Entry::new(reservoirs, rules, [row, receiving, i], inputs, visitor.selected());
            visitor.weigh(reservoirs, rules, &entry, &receiver, inputs);
            i = i.wrapping_add(1);
            if i >= count {
                break;
            }
        }
        visitor.end(rules, row, inputs, count);
        row = row.wrapping_add(1);
        if row >= rows {
            break;
        }
    }
}

/// What a sample is at the receiver of a row.
#[derive(Clone, Copy, Default)]
struct AtReceiver<E> {
    evaluation: E,
    jacobian: f32,
    exists: bool,
}

/// Merges: fills in the matrix, and selects an input after the row in which all is known that the selection asks for.
struct Merger<E> {
    /// The samples of the row.
    row: [AtReceiver<E>; INPUTS],
    combine: Combine<f32>,
    selection: Selection,
    draws: Draws,
    /// The most that another reservoir counts.
    most: f32,
}

impl<R: Reservoirs> Visit<R> for Merger<EvaluationOf<R>> {
    #[inline(always)]
    fn selected(&self) -> u32 {
        self.selection.input
    }

    #[inline(always)]
    fn begin(&mut self, reservoirs: &R, rules: &Rules, row: u32, receiver: &ReceiverOf<R>) {
        self.most = if row == 0 { rules.most_confidence(reservoirs, receiver) } else { f32::MAX };
    }

    #[inline(always)]
    fn evaluate(
        &mut self,
        reservoirs: &R,
        entry: &Entry<SampleOf<R>>,
        shifted: &Shifted<SampleOf<R>>,
        receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    ) {
        let Shifted { sample, jacobian, exists } = *shifted;
        if entry.row == 0 {
            inputs[entry.i as usize].sample = sample;
            inputs[entry.i as usize].jacobian = jacobian;
        }
        let at = &mut self.row[entry.i as usize];
        at.jacobian = jacobian;
        at.exists = exists;
        if exists {
            at.evaluation = reservoirs.domain().evaluate(receiver, sample);
        }
    }

    #[inline(always)]
    fn weigh(
        &mut self,
        reservoirs: &R,
        rules: &Rules,
        entry: &Entry<SampleOf<R>>,
        receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    ) {
        let Entry { row, receiving, i, stored, is_selected, traced } = *entry;
        let AtReceiver { evaluation, jacobian, exists } = self.row[i as usize];
        let (domain, uses) = (reservoirs.domain(), rules.visibility);
        let mut target = 0.0;
        let mut visible_target = 0.0;
        let mut visibility = stored.visibility;
        if exists {
            target = domain.target(&evaluation);
            if traced & (target > 0.0) {
                visibility = domain.visibility(receiver, &evaluation);
            }
            visible_target = domain.visible_target(&evaluation, visibility);
        }
        let weighed = if uses.mis { visible_target } else { target };
        let a = weighed * jacobian;
        if row == 0 {
            let most = if i == 0 { f32::MAX } else { self.most };
            // what is known to be occluded at a pixel is no sample of its own
            let visible = uses.selection | (uses.mis & (rules.others == Others::Unchanged));
            let p = if visible { weighed } else { target };
            let contribution = p * jacobian * stored.contribution_weight;
            self.combine.input(num::min(stored.confidence, most), contribution.within_range());
            inputs[i as usize].target = p;
            inputs[i as usize].visibility = visibility;
        }
        if is_selected {
            self.combine.selected_target(receiving, i, a);
            self.selection.visibility = if receiving == 0 { visibility } else { self.selection.visibility };
        } else if rules.form.asks_for(receiving, i) {
            self.combine.target(receiving, i, a);
        }
    }

    #[inline(always)]
    fn end(&mut self, rules: &Rules, row: u32, inputs: &Inputs<R>, count: u32) {
        let selects_at = if rules.form.is_after_selection() { 0 } else { rules.rows(count).wrapping_sub(1) };
        if row != selects_at {
            return;
        }
        let is_mean = rules.is_for_shading() & rules.visibility.mean;
        self.selection = select::<R>(&self.combine, inputs, count, rng::unit(self.draws.choice().x), is_mean);
        if rules.form.asks_for_selected() & !rules.is_asked_again() {
            let chosen = inputs[self.selection.input as usize];
            self.combine.selected_target(0, self.selection.input, chosen.target * chosen.jacobian);
        }
    }
}

/// Merges the inputs, of which the first is canonical.
#[inline(always)]
pub(crate) fn merge<R: Reservoirs>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    draws: &Draws,
) -> Combined<R::Packed> {
    if count == 1 {
        // alone it stays as it is, without a rounding
        let Input { pixel, reservoir, .. } = inputs[0];
        return Combined { reservoir, source: Source { is_other: false, pixel } };
    }
    let asked = rules.neighbours.wrapping_add(if rules.others == Others::SameFrame { 0 } else { 1 });
    let mut merger = Merger {
        row: [AtReceiver::<EvaluationOf<R>>::default(); INPUTS],
        combine: Combine::new(rules.form, asked as f32),
        selection: Selection::NONE,
        draws: *draws,
        most: f32::MAX,
    };
    walk(reservoirs, rules, inputs, count, &mut merger);
    let (combine, selection) = (&merger.combine, &merger.selection);
    let chosen = inputs[selection.input as usize];
    let reservoir = Reservoir { sample: (), weight_sum: selection.weight_sum, confidence: combine.confidence() };
    let stored = Stored {
        sample: chosen.sample,
        contribution_weight: reservoir.contribution_weight(combine.share(), chosen.target),
        confidence: reservoir.confidence,
        visibility: dithered(selection.visibility, rng::unit(draws.choice().y)),
    };
    let source = Source { is_other: selection.input != 0, pixel: chosen.pixel };
    Combined { reservoir: reservoirs.pack(&stored), source }
}

/// The outcome of a selection.
#[derive(Clone, Copy, Debug)]
struct Selection {
    input: u32,
    /// Of the selected sample, or the mean of all inputs' by weight (Tokuyoshi, eq. 4).
    visibility: Vec3,
    weight_sum: f32,
}

impl Selection {
    const NONE: Self = Self { input: 0, visibility: Vec3::ZERO, weight_sum: 0.0 };
}

/// Selects an input in proportion to its weight by one random number.
#[inline(always)]
fn select<R: Reservoirs>(combine: &Combine<f32>, inputs: &Inputs<R>, count: u32, u: f32, is_mean: bool) -> Selection {
    let mut weights = [0.0; INPUTS];
    let mut sum = 0.0;
    let mut visible = Vec3::ZERO;
    let mut i = 0;
    while i < count {
        let weight = combine.weight(i);
        weights[i as usize] = weight;
        sum += weight;
        visible += inputs[i as usize].visibility * weight;
        i = i.wrapping_add(1);
    }
    let mut chosen = 0;
    let mut below = 0.0;
    let mut open = true;
    i = 0;
    while i < count {
        below += weights[i as usize];
        let here = open & (u * sum < below);
        chosen = if here { i } else { chosen };
        open &= !here;
        i = i.wrapping_add(1);
    }
    let share = |visible: f32| if sum > 0.0 { num::clamp(num::div(visible, sum), 0.0, 1.0) } else { 0.0 };
    let mean = Vec3::new(share(visible.x), share(visible.y), share(visible.z));
    let visibility = if is_mean { mean } else { inputs[chosen as usize].visibility };
    Selection { input: chosen, visibility, weight_sum: sum }
}

/// Lists what [`merge`] evaluates, by calling a function with each sample where it was shifted to, the pixel there, and whether a ray finds
/// its visibility.
#[cfg(not(target_arch = "spirv"))]
struct Lister<E>(E);

#[cfg(not(target_arch = "spirv"))]
impl<R: Reservoirs, E: FnMut(SampleOf<R>, Source, bool)> Visit<R> for Lister<E> {
    #[inline(always)]
    fn selected(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn evaluate(
        &mut self,
        _reservoirs: &R,
        entry: &Entry<SampleOf<R>>,
        shifted: &Shifted<SampleOf<R>>,
        _receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    ) {
        if shifted.exists {
            let to = Source { is_other: entry.receiving != 0, pixel: inputs[entry.receiving as usize].pixel };
            (self.0)(shifted.sample, to, entry.traced);
        }
    }
}

/// What [`merge`] evaluates, in its order, of a form that asks for nothing after the selection: each sample where it was shifted to, the
/// pixel there, and whether a ray finds its visibility.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub(crate) fn evaluated<R: Reservoirs>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    evaluate: impl FnMut(SampleOf<R>, Source, bool),
) {
    if count > 1 {
        walk(reservoirs, rules, inputs, count, &mut Lister(evaluate));
    }
}
