//! What Bitterli et al.'s supplement says of targets in place of densities, and what provenance must give.

use super::support::{MIS, is_unbiased, near};
use restir_shared::resample::mis::Mis;
use restir_tests::random::SplitMix;
use restir_tests::resampling::expectation::truth;
use restir_tests::resampling::forms::{Form, Input};
use restir_tests::resampling::setting::{Setting, UNEQUAL};
use restir_tests::resampling::table::{LIGHTS, PIXELS, radiance};
use restir_tests::resampling::trials::{Kept, measure, table};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};

const TRIALS: u64 = 100_000;
type Table = [[f64; LIGHTS]; PIXELS];

/// Moments of the estimate, relative to the truth, with each table told to the MIS weights.
fn estimates<const N: usize>(setting: &Setting, mis: Mis, told: [&Table; N]) -> [Moments; N] {
    let truth = truth();
    measure(2, TRIALS, |random| {
        let kept = setting.draw(random);
        let u = std::array::from_fn(|_| random.unit());
        told.map(|told| setting.estimate(Form::Library(mis), &kept, |pixel, light| told[pixel][light], &u) / truth)
    })
}

/// Any functions that are positive exactly where the inputs can produce the sample.
pub(crate) fn any_positive_function_is_unbiased() {
    let mut family = Family::new("arbitrary functions", FAMILY_RATE);
    for setting in [Setting::ALL[1], Setting::ALL[3], Setting::ALL[5]] {
        let arbitrary = table(|pixel, light| {
            let value = SplitMix::new((100 * pixel + light) as u64).range(-3.0, 3.0).exp2();
            if setting.can_hold(pixel, light) { value } else { 0.0 }
        });
        for mis in MIS.into_iter().filter(|&mis| is_unbiased(mis)) {
            let [moments] = estimates(&setting, mis, [&arbitrary]);
            family.z_test(format!("{mis:?}, {}", setting.name()), ZTest::new(moments, Moments::exact(1.0)));
        }
    }
    family.assert();
}

/// Two neighbours whose targets are 100 times as large, which skews the weights: the variance rises, the mean does not
/// change. Normalised targets are as unbiased.
pub(crate) fn unnormalised_targets_cost_variance_only() {
    let mut family = Family::new("unnormalised targets", FAMILY_RATE);
    let setting = Setting::ALL[0];
    let plain = table(|pixel, light| setting.mis_target(pixel, light));
    let skewed = table(|pixel, light| plain[pixel][light] * if pixel > 2 { 100.0 } else { 1.0 });
    let normalised = normalised(&plain);
    for mis in [Mis::CONTRIBUTION, Mis::TALBOT, Mis::PAIRWISE] {
        let moments = estimates(&setting, mis, [&plain, &normalised, &skewed]);
        let [plain, normalised, skewed] = moments.map(|moments| moments.variance());
        println!("{mis:?}: variance {plain:.3}, normalised {normalised:.3}, skewed {skewed:.3}");
        for (name, moments) in ["plain", "normalised", "skewed"].into_iter().zip(moments) {
            family.z_test(format!("{mis:?}, {name}"), ZTest::new(moments, Moments::exact(1.0)));
        }
        assert!(skewed > 1.2 * plain, "{mis:?}: the variance of {plain} is {skewed} with skewed targets");
    }
    family.assert();
}

/// The targets of each pixel divided by their sum.
fn normalised(targets: &Table) -> Table {
    targets.map(|row| {
        let sum: f64 = row.iter().sum();
        row.map(|target| target / sum)
    })
}

/// With few candidates a target says little of the density with which samples come: the variance of contribution MIS by
/// normalised targets approaches that by the densities themselves as candidates are added.
pub(crate) fn targets_approach_densities_with_candidates() {
    let mut gaps = Vec::new();
    for candidates in [1, 4, 16, 64] {
        let setting = Setting { confidence: [candidates; PIXELS], ..Setting::ALL[2] };
        let targets = normalised(&table(|pixel, light| setting.mis_target(pixel, light)));
        let densities = densities(&setting);
        let [by_target, by_density] = estimates(&setting, Mis::CONTRIBUTION, [&targets, &densities]);
        gaps.push(by_target.variance() / by_density.variance() - 1.0);
    }
    println!("excess of the variance for 1, 4, 16, 64 candidates: {gaps:.4?}");
    assert!(gaps.windows(2).all(|pair| pair[1] < pair[0]), "{gaps:?} does not fall");
}

/// How often each pixel keeps each light.
fn densities(setting: &Setting) -> Table {
    let mut counts = [[0.0; LIGHTS]; PIXELS];
    for index in 0..20_000 {
        for (pixel, Kept { light, weight }) in setting.draw(&mut SplitMix::new(index)).into_iter().enumerate() {
            counts[pixel][light] += if weight > 0.0 { 1.0 } else { 0.0 };
        }
    }
    counts.map(|row| row.map(|count| count / 20_000.0))
}

/// The share of contribution MIS is the selected sample's target where it comes from; the confidence is the sum.
pub(crate) fn provenance_and_confidence() {
    let setting = Setting::ALL[1];
    for index in 0..20_000 {
        let mut random = SplitMix::new(index);
        let kept = setting.draw(&mut random);
        let a = |j: usize, i: usize| setting.mis_target(j, kept[i].light);
        let inputs: [Input<f64>; PIXELS] = std::array::from_fn(|i| Input {
            confidence: f64::from(UNEQUAL[i]),
            contribution: radiance(i, kept[i].light) * kept[i].weight,
        });
        for mis in MIS {
            let combined = Form::Library(mis).combine(&inputs, a, || random.unit());
            assert!(combined.reservoir.confidence == 31.0, "M = {}", combined.reservoir.confidence);
            let source = combined.reservoir.sample;
            if (mis == Mis::CONTRIBUTION) & (combined.reservoir.weight_sum > 0.0) {
                let sum: f64 = (0..PIXELS).map(|j| inputs[j].confidence * a(j, source)).sum();
                let wanted = a(source, source) / sum;
                assert!(combined.share == wanted, "{} for {wanted}", combined.share);
            }
            assert!(
                (combined.reservoir.weight_sum == 0.0) | (combined.weights[source] > 0.0),
                "{mis:?} selects input {source} of weight zero"
            );
            let sum: f64 = combined.weights.iter().sum();
            assert!(near(combined.reservoir.weight_sum, sum, 1e-15), "{mis:?}: the sum is not {sum}");
        }
    }
}
