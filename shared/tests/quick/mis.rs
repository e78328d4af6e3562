//! Weights of multiple importance sampling share what several reservoirs can produce.

use restir_shared::resample::mis::{Combine, INPUTS, Mis};

/// Confidences of inputs, and the target of a sample at the pixel of each. The first one is canonical, the third one cannot produce the sample,
/// and the last one is as if it were not there.
const CONFIDENCES: [f64; 4] = [1.0, 20.0, 3.0, 0.0];
const TARGETS: [f64; 4] = [2.0, 0.5, 0.0, 7.0];

/// The sum of the weights that all inputs have for the sample.
fn sum_of_weights(form: Mis) -> f64 {
    let count = CONFIDENCES.len() as u32;
    let mut combine = Combine::new(form, f64::from(count - 1));
    CONFIDENCES.iter().for_each(|&confidence| combine.input(confidence, 1.0));
    for receiver in 0..count {
        for sample in (0..count).filter(|&sample| form.asks_for(receiver, sample)) {
            combine.target(receiver, sample, TARGETS[receiver as usize]);
        }
    }
    assert!(CONFIDENCES.len() <= INPUTS && combine.confidence() == CONFIDENCES.iter().sum());
    (0..count).map(|input| combine.weight(input)).sum()
}

#[test]
fn weights_of_a_sample_sum_to_one() {
    for form in [Mis::TALBOT, Mis::PAIRWISE, Mis::PAIRWISE_DEFENSIVE, Mis::CONSTANT] {
        let sum = sum_of_weights(form);
        assert!((sum - 1.0).abs() < 1.0e-12, "{form:?}: {sum}");
    }
}
