//! The contract of all forms: the weights of all inputs that can produce a sample sum to one.

use crate::support::{MIS, family, is_unbiased, near, report};
use libtest_mimic::Failed;
use restir_shared::resample::mis::{Combine, INPUTS, Mis};
use restir_tests::random::SplitMix;
use restir_tests::resampling::expectation::factor;
use restir_tests::resampling::forms::{Form, Input, Real};
use restir_tests::stats::histogram;
use restir_tests::suite::ensure;

const CASES: u64 = 100_000;

/// Confidence of the inputs and their targets for one sample.
struct Case {
    requested: f64,
    confidence: Vec<f64>,
    target: Vec<f64>,
}

impl Case {
    /// A fifth of the neighbours are rejected, a quarter of the targets zero; a tenth of the canonical ones.
    fn random(index: u64) -> Self {
        let mut random = SplitMix::new(index);
        let k = 1 + random.below(INPUTS);
        let requested = (k - 1 + random.below(INPUTS + 1 - k)) as f64;
        let log = |random: &mut SplitMix, range: f64| random.range(-range, range).exp2();
        let mut confidence: Vec<f64> = (0..k)
            .map(|_| match random.below(5) {
                0 => 0.0,
                1 | 2 => 1.0 + random.below(20) as f64,
                _ => log(&mut random, 6.0),
            })
            .collect();
        let mut target: Vec<f64> =
            (0..k).map(|_| if random.below(4) == 0 { 0.0 } else { log(&mut random, 20.0) }).collect();
        confidence[0] = confidence[0].max(0.5);
        if random.below(10) > 0 {
            target[0] = log(&mut random, 20.0);
        }
        Self { requested, confidence, target }
    }

    /// With which factor each input's copy of the sample counts.
    fn factors<T: Real>(&self, mis: Mis) -> Vec<T> {
        let mut combine = Combine::new(mis, T::of(self.requested));
        let k = self.confidence.len() as u32;
        let a = |receiver: u32| T::of(self.target[receiver as usize]);
        self.confidence.iter().for_each(|&m| combine.input(T::of(m), T::ONE));
        for sample in 0..k {
            (0..k).filter(|&j| mis.asks_for(j, sample)).for_each(|j| combine.target(j, sample, a(j)));
        }
        let factor = |source: u32| {
            let mut combine = combine;
            if mis.asks_for_selected() {
                (0..k).for_each(|j| combine.selected_target(j, source, a(j)));
            }
            if self.target[source as usize] > 0.0 { combine.weight(source) * combine.share() } else { T::ZERO }
        };
        (0..k).map(factor).collect()
    }

    fn check<T: Real>(&self, mis: Mis, tolerance: f64) -> Result<(), Failed> {
        let factors = self.factors::<T>(mis);
        let sum: f64 = factors.iter().map(|&factor| factor.into()).sum();
        let is_full = self.target.iter().all(|&a| a > 0.0);
        let is_one = (self.target[0] > 0.0) & (is_full | is_unbiased(mis));
        let fits = if is_one { (sum - 1.0).abs() <= tolerance } else { (0.0..=1.0 + tolerance).contains(&sum) };
        ensure(fits, || format!("{mis:?} of {:?}, {:?}, {}: {factors:?}", self.confidence, self.target, self.requested))
    }
}

pub(crate) fn weights_of_a_sample_sum_to_one() -> Result<(), Failed> {
    for index in 0..CASES {
        let case = Case::random(index);
        for mis in MIS {
            case.check::<f32>(mis, 1e-6)?;
            case.check::<f64>(mis, 1e-12)?;
            // the closed form knows only of as many neighbours as were asked for
            if case.requested as usize + 1 == case.confidence.len() {
                for (i, value) in case.factors::<f64>(mis).into_iter().enumerate().filter(|_| case.target[0] > 0.0) {
                    let exact = factor(Form::Library(mis), &case.confidence, &case.target, i);
                    let exact = if case.target[i] > 0.0 { exact } else { 0.0 };
                    ensure(near(value, exact, 1e-12), || format!("{mis:?}, input {i}: {value} for {exact}"))?;
                }
            }
        }
    }
    Ok(())
}

/// The same test sees that the printed formulas break the contract: the sum is off by the mean M, or wherever M differs.
pub(crate) fn literal_weights_do_not() -> Result<(), Failed> {
    let sum = |form: Form, m: &[f64]| {
        let a = [1.0, 0.5, 2.0];
        (0..3).map(|i| factor(form, m, &a, i)).sum::<f64>()
    };
    let (equal, unequal) = ([4.0; 3], [4.0, 8.0, 2.0]);
    ensure(near(sum(Form::LiteralContribution, &equal), 4.0, 1e-12), || "Alg. 1 is not 4 times too much".to_owned())?;
    ensure(near(sum(Form::LiteralTalbot, &equal), 1.0, 1e-12), || "Alg. 2 is wrong for equal M".to_owned())?;
    ensure(!near(sum(Form::LiteralTalbot, &unequal), 1.0, 1e-2), || "Alg. 2 is right for unequal M".to_owned())
}

/// A sample that one input alone can produce has the weight 1 there, and 0 where it cannot be produced (Tokuyoshi, eq. 3).
pub(crate) fn who_is_alone_has_all() -> Result<(), Failed> {
    let confidence = vec![1.0, 4.0, 2.0];
    for alone in 0..3 {
        let mut target = vec![0.0; 3];
        target[alone] = 0.3;
        let case = Case { requested: 2.0, confidence: confidence.clone(), target };
        for mis in [Mis::ONE_OVER_Z, Mis::CONTRIBUTION, Mis::TALBOT] {
            for (i, factor) in case.factors::<f32>(mis).into_iter().enumerate() {
                let wanted = if i == alone { 1.0 } else { 0.0 };
                let fits = (factor - wanted).abs() <= f32::EPSILON;
                ensure(fits, || format!("{mis:?}, input {i} of {alone} alone: {factor}"))?;
            }
        }
    }
    Ok(())
}

/// A combine of random inputs, some of them with confidence zero, and the same without those.
pub(crate) fn rejected_inputs_are_as_if_absent() -> Result<(), Failed> {
    for index in 0..CASES / 10 {
        let mut random = SplitMix::new(index);
        let k = 1 + random.below(INPUTS);
        let a: Vec<f32> = (0..k * k).map(|_| random.unit() as f32).collect();
        let all: Vec<(usize, Input<f32>)> = (0..k)
            .map(|i| {
                let confidence = if (i > 0) & (random.below(2) == 0) { 0.0 } else { 1.0 + random.below(9) as f32 };
                (i, Input { confidence, contribution: random.unit() as f32 })
            })
            .collect();
        let valid: Vec<_> = all.iter().copied().filter(|(_, input)| input.confidence > 0.0).collect();
        for mis in MIS {
            let weigh = |inputs: &[(usize, Input<f32>)]| {
                let mut combine = Combine::new(mis, INPUTS as f32);
                inputs.iter().for_each(|(_, input)| combine.input(input.confidence, input.contribution));
                let a = |j: usize, i: usize| a[inputs[j].0 * k + inputs[i].0];
                for (j, i) in (0..inputs.len()).flat_map(|j| (0..inputs.len()).map(move |i| (j, i))) {
                    if mis.asks_for(j as u32, i as u32) {
                        combine.target(j as u32, i as u32, a(j, i));
                    }
                }
                if mis.asks_for_selected() {
                    (0..inputs.len()).for_each(|j| combine.selected_target(j as u32, 0, a(j, 0)));
                }
                combine
            };
            let (with, without) = (weigh(&all), weigh(&valid));
            ensure(with.share() == without.share(), || format!("{mis:?}, case {index}: shares differ"))?;
            for (at, (i, _)) in valid.iter().enumerate() {
                let (a, b) = (with.weight(*i as u32), without.weight(at as u32));
                ensure(a == b, || format!("{mis:?}, case {index}, input {i}: {a} and {b}"))?;
            }
            if valid.len() == 1 {
                let (weight, wanted) = (with.weight(0) * with.share(), all[0].1.contribution);
                // weights after the selection are multiplied by M and divided by it
                let slack = if mis.is_after_selection() { 2.0 * f32::EPSILON } else { 0.0 };
                ensure((weight - wanted).abs() <= slack * wanted, || format!("{mis:?} alone: {weight} for {wanted}"))?;
            }
        }
    }
    Ok(())
}

/// The canonical input is the first one; the others may come in any order.
pub(crate) fn neighbours_have_no_order() -> Result<(), Failed> {
    const ORDER: [usize; 4] = [0, 3, 1, 2];
    const M: [f64; 4] = [2.0, 5.0, 1.0, 3.0];
    const CONTRIBUTION: [f64; 4] = [0.4, 0.7, 0.2, 0.9];
    const A: [[f64; 4]; 4] = [[1.0, 0.5, 2.0, 0.1], [0.3, 1.0, 0.0, 0.7], [2.0, 0.2, 0.4, 0.6], [0.9, 0.8, 0.1, 1.5]];
    let mut family = family("orders");
    for mis in MIS {
        let form = Form::Library(mis);
        let run = |order: [usize; 4], u: &mut dyn FnMut() -> f64| {
            let inputs = order.map(|i| Input { confidence: M[i], contribution: CONTRIBUTION[i] });
            form.combine(&inputs, |j, i| A[order[j]][order[i]], u)
        };
        let (one, other) = (run([0, 1, 2, 3], &mut || 0.5), run(ORDER, &mut || 0.5));
        for (at, &i) in ORDER.iter().enumerate() {
            let (a, b) = (one.weights[i], other.weights[at]);
            ensure(near(a, b, 1e-14), || format!("{mis:?}, input {i}: {a} and {b}"))?;
        }
        const DRAWS: u64 = 100_000;
        let counts = histogram(4, DRAWS, |index| {
            let mut random = SplitMix::new(index);
            ORDER[run(ORDER, &mut || random.unit()).reservoir.sample]
        });
        let expected = |i: usize| one.weights[i] / one.reservoir.weight_sum * DRAWS as f64;
        let name = form.name();
        family.chi_square(name, counts.into_iter().enumerate().map(|(i, count)| (count, expected(i))));
    }
    report(&family)
}
