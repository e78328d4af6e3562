//! One combine that can be checked by hand: three inputs, of which the third cannot be produced by the second's pixel, and
//! the first two of them alone.

use crate::support::{keep, near};
use libtest_mimic::Failed;
use restir_shared::resample::mis::Mis;
use restir_tests::resampling::forms::{Form, Input, Real};
use restir_tests::suite::ensure;

const CONFIDENCE: [f64; 3] = [1.0, 4.0, 2.0];
const WEIGHT: [f64; 3] = [0.5, 0.25, 0.8];
/// Of each pixel for each sample.
const TARGET: [[f64; 3]; 3] = [[2.0, 1.0, 0.5], [1.0, 3.0, 0.0], [0.5, 0.4, 1.5]];
/// Of the samples at the canonical pixel.
const VISIBILITY: [f64; 3] = [1.0, 0.0, 1.0];
const TOLERANCE: f64 = 1e-6;

struct Golden {
    form: Form,
    weights: &'static [f64],
    sum: f64,
    /// The contribution weight if the sample is selected.
    contribution: &'static [f64],
    /// The averaged visibility, where averaging is allowed.
    average: Option<f64>,
}

const LIBRARY: [Golden; 11] = [
    Golden {
        form: Form::Library(Mis::ONE_OVER_M),
        weights: &[1.0, 1.0, 0.8],
        sum: 2.8,
        contribution: &[0.2, 0.4, 0.8],
        average: Some(0.642_857_1),
    },
    Golden {
        form: Form::Library(Mis::ONE_OVER_Z),
        weights: &[1.0, 1.0, 0.8],
        sum: 2.8,
        contribution: &[0.2, 0.4, 1.866_666_7],
        average: None,
    },
    Golden {
        form: Form::Library(Mis::CONTRIBUTION),
        weights: &[1.0, 1.0, 0.8],
        sum: 2.8,
        contribution: &[0.4, 0.608_695_7, 2.4],
        average: None,
    },
    Golden {
        form: Form::Library(Mis::TALBOT),
        weights: &[0.285_714_3, 0.217_391_3, 0.342_857_1],
        sum: 0.845_962_7,
        contribution: &[0.422_981_4, 0.845_962_7, 1.691_925],
        average: Some(0.743_025_0),
    },
    Golden {
        form: Form::Library(Mis::CONSTANT),
        weights: &[0.142_857_1, 0.142_857_1, 0.114_285_7],
        sum: 0.4,
        contribution: &[0.2, 0.4, 0.8],
        average: Some(0.642_857_1),
    },
    Golden {
        form: Form::Library(Mis::PAIRWISE),
        weights: &[0.3, 0.157_894_7, 0.126_315_8],
        sum: 0.584_210_5,
        contribution: &[0.292_105_3, 0.584_210_5, 1.168_421],
        average: Some(0.729_729_7),
    },
    Golden {
        form: Form::Library(Mis::PAIRWISE_DEFENSIVE),
        weights: &[0.4, 0.135_338_3, 0.108_270_7],
        sum: 0.643_609_0,
        contribution: &[0.321_804_5, 0.643_609_0, 1.287_218],
        average: Some(0.789_719_6),
    },
    Golden {
        form: Form::Library(Mis::PAIRWISE_COUNTED),
        weights: &[0.35, 0.12, 0.184_615_4],
        sum: 0.654_615_4,
        contribution: &[0.327_307_7, 0.654_615_4, 1.309_231],
        average: Some(0.816_686_3),
    },
    Golden {
        form: Form::Library(Mis::PAIRWISE_COUNTED_DEFENSIVE),
        weights: &[0.566_666_7, 0.08, 0.123_076_9],
        sum: 0.769_743_6,
        contribution: &[0.384_871_8, 0.769_743_6, 1.539_487],
        average: Some(0.896_069_3),
    },
    // two inputs: the balance heuristic of Tokuyoshi's Algorithm 1
    Golden {
        form: Form::Library(Mis::TALBOT),
        weights: &[0.333_333_3, 0.230_769_2],
        sum: 0.564_102_6,
        contribution: &[0.282_051_3, 0.564_102_6],
        average: Some(0.590_909_1),
    },
    // two inputs: the defensive balance heuristic of bevy is the defensive pairwise form
    Golden {
        form: Form::Library(Mis::PAIRWISE_DEFENSIVE),
        weights: &[0.466_666_7, 0.184_615_4],
        sum: 0.651_282_1,
        contribution: &[0.325_641_0, 0.651_282_1],
        average: None,
    },
];

const LITERAL: [Golden; 2] = [
    Golden {
        form: Form::LiteralContribution,
        weights: &[1.0, 1.0, 0.8],
        sum: 2.8,
        contribution: &[0.8, 1.909_091, 4.2],
        average: None,
    },
    Golden {
        form: Form::LiteralTalbot,
        weights: &[1.714_286, 2.045_455, 1.8],
        sum: 5.559_740,
        contribution: &[0.397_124_3, 0.794_248_6, 1.588_497],
        average: Some(0.632_095_3),
    },
];

fn check<T: Real>(golden: &Golden) -> Result<(), Failed> {
    let k = golden.weights.len();
    let inputs: Vec<Input<T>> = (0..k)
        .map(|i| Input { confidence: T::of(CONFIDENCE[i]), contribution: T::of(TARGET[0][i]) * T::of(WEIGHT[i]) })
        .collect();
    let equal = |what: &str, i: usize, value: T, wanted: f64| {
        let value: f64 = value.into();
        ensure(near(value, wanted, TOLERANCE), || {
            format!("{} of {k}, {what} {i}: {value} for {wanted}", golden.form.name())
        })
    };
    for (selected, &contribution) in golden.contribution.iter().enumerate() {
        let combined = golden.form.combine(&inputs, |j, i| T::of(TARGET[j][i]), keep(selected));
        for (i, &weight) in golden.weights.iter().enumerate() {
            equal("weight", i, combined.weights[i], weight)?;
        }
        equal("sum", 0, combined.reservoir.weight_sum, golden.sum)?;
        equal("confidence", 0, combined.reservoir.confidence, CONFIDENCE[..k].iter().sum())?;
        ensure(combined.reservoir.sample == selected, || format!("{selected} is not selected"))?;
        let weight = combined.reservoir.contribution_weight(combined.share, T::of(TARGET[0][selected]));
        equal("contribution weight", selected, weight, contribution)?;
        if let Some(average) = golden.average {
            equal("average", 0, combined.average(k, |i| T::of(VISIBILITY[i])), average)?;
        }
    }
    Ok(())
}

fn check_all(list: &[Golden]) -> Result<(), Failed> {
    list.iter().try_for_each(|golden| check::<f32>(golden).and_then(|()| check::<f64>(golden)))
}

pub(crate) fn golden_values() -> Result<(), Failed> {
    check_all(&LIBRARY)
}

pub(crate) fn literal_algorithms_have_their_values() -> Result<(), Failed> {
    check_all(&LITERAL)
}
