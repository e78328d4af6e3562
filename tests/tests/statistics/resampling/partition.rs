//! The contract of all forms: the weights of all inputs that can produce a sample sum to one.

use super::support::{MIS, is_unbiased, near};
use restir_shared::resample::mis::{INPUTS, Mis};
use restir_tests::random::SplitMix;
use restir_tests::resampling::expectation::factor;
use restir_tests::resampling::forms::{Form, Input, Real, share, weighed};
use restir_tests::stats::{FAMILY_RATE, Family};

const CASES: u64 = 100_000;

/// Confidence of the inputs and their targets for one sample.
struct Case {
    requested: usize,
    confidence: Vec<f64>,
    target: Vec<f64>,
}

impl Case {
    /// A fifth of the neighbours are rejected, a quarter of the targets zero; a tenth of the canonical ones.
    fn random(index: u64) -> Self {
        let mut random = SplitMix::new(index);
        let k = 1 + random.below(INPUTS);
        let requested = k - 1 + random.below(INPUTS + 1 - k);
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
        let input = |&m: &f64| Input { confidence: T::of(m), contribution: T::ONE };
        let inputs: Vec<Input<T>> = self.confidence.iter().map(input).collect();
        let a = |receiver: usize, _| T::of(self.target[receiver]);
        let combine = weighed(mis, self.requested, &inputs, a);
        let factor = |source: usize| {
            let share = share(mis, combine, inputs.len(), source, a);
            if self.target[source] > 0.0 { combine.weight(source as u32) * share } else { T::ZERO }
        };
        (0..inputs.len()).map(factor).collect()
    }

    fn check<T: Real>(&self, mis: Mis, tolerance: f64) {
        let factors = self.factors::<T>(mis);
        let sum: f64 = factors.iter().map(|&factor| factor.into()).sum();
        let is_full = self.target.iter().all(|&a| a > 0.0);
        let is_one = (self.target[0] > 0.0) & (is_full | is_unbiased(mis));
        let fits = if is_one { (sum - 1.0).abs() <= tolerance } else { (0.0..=1.0 + tolerance).contains(&sum) };
        assert!(fits, "{mis:?} of {:?}, {:?}, {}: {factors:?}", self.confidence, self.target, self.requested);
    }
}

pub(crate) fn weights_of_a_sample_sum_to_one() {
    for index in 0..CASES {
        let case = Case::random(index);
        for mis in MIS {
            case.check::<f32>(mis, 1e-6);
            case.check::<f64>(mis, 1e-12);
            // the closed form knows only of as many neighbours as were asked for
            if case.requested + 1 == case.confidence.len() {
                for (i, value) in case.factors::<f64>(mis).into_iter().enumerate().filter(|_| case.target[0] > 0.0) {
                    let exact = factor(Form::Library(mis), &case.confidence, &case.target, i);
                    let exact = if case.target[i] > 0.0 { exact } else { 0.0 };
                    assert!(near(value, exact, 1e-12), "{mis:?}, input {i}: {value} for {exact}");
                }
            }
        }
    }
}

/// The same test sees that the printed formulas break the contract: the sum is off by the mean M, or wherever M differs.
pub(crate) fn literal_weights_do_not() {
    let sum = |form: Form, m: &[f64]| {
        let a = [1.0, 0.5, 2.0];
        (0..3).map(|i| factor(form, m, &a, i)).sum::<f64>()
    };
    let (equal, unequal) = ([4.0; 3], [4.0, 8.0, 2.0]);
    assert!(near(sum(Form::LiteralContribution, &equal), 4.0, 1e-12), "Alg. 1 is not 4 times too much");
    assert!(near(sum(Form::LiteralTalbot, &equal), 1.0, 1e-12), "Alg. 2 is wrong for equal M");
    assert!(!near(sum(Form::LiteralTalbot, &unequal), 1.0, 1e-2), "Alg. 2 is right for unequal M");
}

/// A sample that one input alone can produce has the weight 1 there, and 0 where it cannot be produced (Tokuyoshi, eq. 3).
pub(crate) fn who_is_alone_has_all() {
    let confidence = vec![1.0, 4.0, 2.0];
    for alone in 0..3 {
        let mut target = vec![0.0; 3];
        target[alone] = 0.3;
        let case = Case { requested: 2, confidence: confidence.clone(), target };
        for mis in [Mis::ONE_OVER_Z, Mis::CONTRIBUTION, Mis::TALBOT] {
            for (i, factor) in case.factors::<f32>(mis).into_iter().enumerate() {
                let wanted = if i == alone { 1.0 } else { 0.0 };
                let fits = (factor - wanted).abs() <= f32::EPSILON;
                assert!(fits, "{mis:?}, input {i} of {alone} alone: {factor}");
            }
        }
    }
}

/// A combine of random inputs, some of them with confidence zero, and the same without those.
pub(crate) fn rejected_inputs_are_as_if_absent() {
    for index in 0..CASES / 10 {
        let mut random = SplitMix::new(index);
        let k = 1 + random.below(INPUTS);
        let a: Vec<f32> = (0..k * k).map(|_| random.unit() as f32).collect();
        let all: Vec<Input<f32>> = (0..k)
            .map(|i| {
                let confidence = if (i > 0) & (random.below(2) == 0) { 0.0 } else { 1.0 + random.below(9) as f32 };
                Input { confidence, contribution: random.unit() as f32 }
            })
            .collect();
        let valid: Vec<usize> = (0..k).filter(|&i| all[i].confidence > 0.0).collect();
        for mis in MIS {
            let weigh = |chosen: &[usize]| {
                let inputs: Vec<_> = chosen.iter().map(|&i| all[i]).collect();
                let a = |j: usize, i: usize| a[chosen[j] * k + chosen[i]];
                let combine = weighed(mis, INPUTS, &inputs, a);
                (combine, share(mis, combine, inputs.len(), 0, a))
            };
            let ((with, share), (without, other)) = (weigh(&Vec::from_iter(0..k)), weigh(&valid));
            assert!(share == other, "{mis:?}, case {index}: shares differ");
            for (at, &i) in valid.iter().enumerate() {
                let (a, b) = (with.weight(i as u32), without.weight(at as u32));
                assert!(a == b, "{mis:?}, case {index}, input {i}: {a} and {b}");
            }
            if valid.len() == 1 {
                let (weight, wanted) = (with.weight(0) * share, all[0].contribution);
                // weights after the selection are multiplied by M and divided by it
                let slack = if mis.is_after_selection() { 2.0 * f32::EPSILON } else { 0.0 };
                assert!((weight - wanted).abs() <= slack * wanted, "{mis:?} alone: {weight} for {wanted}");
            }
        }
    }
}

/// The canonical input is the first one; the others may come in any order.
pub(crate) fn neighbours_have_no_order() {
    const ORDER: [usize; 4] = [0, 3, 1, 2];
    const M: [f64; 4] = [2.0, 5.0, 1.0, 3.0];
    const CONTRIBUTION: [f64; 4] = [0.4, 0.7, 0.2, 0.9];
    const A: [[f64; 4]; 4] = [[1.0, 0.5, 2.0, 0.1], [0.3, 1.0, 0.0, 0.7], [2.0, 0.2, 0.4, 0.6], [0.9, 0.8, 0.1, 1.5]];
    let mut family = Family::new("orders", FAMILY_RATE);
    for mis in MIS {
        let form = Form::Library(mis);
        let run = |order: [usize; 4], u: &mut dyn FnMut() -> f64| {
            let inputs = order.map(|i| Input { confidence: M[i], contribution: CONTRIBUTION[i] });
            form.combine(&inputs, |j, i| A[order[j]][order[i]], u)
        };
        let (one, other) = (run([0, 1, 2, 3], &mut || 0.5), run(ORDER, &mut || 0.5));
        for (at, &i) in ORDER.iter().enumerate() {
            let (a, b) = (one.weights[i], other.weights[at]);
            assert!(near(a, b, 1e-14), "{mis:?}, input {i}: {a} and {b}");
        }
        let selected = |index| {
            let mut random = SplitMix::new(index);
            ORDER[run(ORDER, &mut || random.unit()).reservoir.sample]
        };
        let share = |i: usize| one.weights[i] / one.reservoir.weight_sum;
        family.histogram(form.name(), 4, 100_000, selected, share);
    }
    family.assert();
}
