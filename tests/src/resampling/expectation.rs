//! What the forms estimate, in closed form and independently of the library.
//!
//! A contribution weight is unbiased: `E[g(x_i) W_i]` is the sum of g over what input i can hold (Lin et al. 2022). The
//! weight of an input depends on its own sample alone, so the expectation of a combine is `sum_i sum_y F_i(y) f(y) V(y)`
//! over the y that input i can hold, F_i being the MIS weight, times M_i in the forms that apply it after the selection.

use super::forms::Form;
use super::setting::Setting;
use super::table::{LIGHTS, PIXELS, radiance};
use restir_shared::resample::mis::Mis;

/// The expectation of a form's estimate, relative to the truth.
pub fn expectation(form: Form, setting: &Setting) -> f64 {
    let confidence = setting.confidence.map(f64::from);
    let mut sum = 0.0;
    for light in 0..LIGHTS {
        let a: [f64; PIXELS] = std::array::from_fn(|pixel| setting.mis_target(pixel, light));
        for pixel in (0..PIXELS).filter(|&pixel| setting.can_hold(pixel, light)) {
            sum += factor(form, &confidence, &a, pixel) * radiance(0, light);
        }
    }
    sum / truth()
}

/// The light that the canonical pixel receives.
pub fn truth() -> f64 {
    (0..LIGHTS).map(|light| radiance(0, light)).sum()
}

/// With which factor input i's copy of a sample counts, `a` being the targets of that sample at all inputs, with a_i > 0:
/// the formulas of Bitterli et al. 2020 and its supplement, Bitterli 2022 (chapter 9) and Lin et al. 2022, as written.
pub fn factor(form: Form, m: &[f64], a: &[f64], i: usize) -> f64 {
    let k = m.len();
    let all: f64 = m.iter().sum();
    let weighted: f64 = m.iter().zip(a).map(|(m, a)| m * a).sum();
    match form {
        Form::Library(Mis::ONE_OVER_M | Mis::CONSTANT) => m[i] / all,
        Form::Library(Mis::ONE_OVER_Z) => {
            let able: f64 = m.iter().zip(a).filter(|(_, a)| **a > 0.0).map(|(m, _)| m).sum();
            m[i] / able
        }
        Form::Library(Mis::CONTRIBUTION | Mis::TALBOT) => m[i] * a[i] / weighted,
        Form::LiteralContribution => m[i] * a[i] / a.iter().sum::<f64>(),
        Form::LiteralTalbot => m[i] * a[i] / (a.iter().sum::<f64>() / k as f64) / all,
        Form::Library(mis) => pairwise(mis, m, a, i),
    }
}

/// The neighbours' trust against the canonical input, the shares of the pairs and what is the canonical input's alone.
fn pairwise(mis: Mis, m: &[f64], a: &[f64], i: usize) -> f64 {
    let counted = mis.is(Mis::PAIRWISE_COUNTED);
    let defensive = mis.is(Mis::DEFENSIVE);
    let requested = (m.len() - 1) as f64;
    let others: f64 = m[1..].iter().sum();
    let valid = m[1..].iter().filter(|m| **m > 0.0).count() as f64;
    let (neighbours, own) = if counted { (valid, 1.0) } else { (others, m[0]) };
    if neighbours == 0.0 {
        return if i == 0 { 1.0 } else { 0.0 };
    }
    let total = neighbours + if defensive { own } else { 0.0 };
    let share = |j: usize| match (m[j] > 0.0, counted) {
        (false, _) => 0.0,
        (true, true) => 1.0 / total,
        (true, false) => m[j] / total,
    };
    let trust = |j: usize| if counted { requested * m[j] } else { others } * a[j];
    let canonical = m[0] * a[0];
    if i > 0 {
        return share(i) * trust(i) / (trust(i) + canonical);
    }
    let pairs: f64 = (1..m.len()).map(|j| share(j) * canonical / (canonical + trust(j))).sum();
    pairs + if defensive { own / total } else { 0.0 }
}
