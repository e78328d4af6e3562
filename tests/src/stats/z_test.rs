//! The z-test between two means.

use super::{Moments, POWER, detectable_bias, two_sided_p};

/// A comparison of two means, of independent and many values each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// The first mean less the second.
    pub difference: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Their ratio.
    pub z: f64,
    /// The probability of a |z| at least as large, if the expectations are equal; zero for what is not a number.
    pub p: f64,
}

impl ZTest {
    /// Compares the means of two streams; [`Moments::exact`] is a known expectation.
    pub fn new(tested: Moments, reference: Moments) -> Self {
        let difference = tested.mean() - reference.mean();
        let standard_error = (tested.variance_of_mean() + reference.variance_of_mean()).sqrt();
        let z = if difference == 0.0 { 0.0 } else { difference / standard_error };
        Self { difference, standard_error, z, p: if z.is_finite() { two_sided_p(z) } else { 0.0 } }
    }

    /// The bias that the test notices with a probability of [`POWER`] when it is wrong about equal expectations with
    /// the probability `false_alarm`. A test without this number says little.
    pub fn detectable_bias(&self, false_alarm: f64) -> f64 {
        detectable_bias(self.standard_error, false_alarm, POWER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    fn noise(stream: u64, mean: f64) -> Moments {
        let mut random = SplitMix::new(stream);
        (0..1000).map(|_| mean + random.unit() - 0.5).collect()
    }

    #[test]
    fn the_power_is_as_stated() {
        const RATE: f64 = 1e-3;
        let bias = ZTest::new(noise(0, 1.0), Moments::exact(1.0)).detectable_bias(RATE);
        let alarms =
            |bias: f64| (1..=2000).filter(|&i| ZTest::new(noise(i, 1.0 + bias), Moments::exact(1.0)).p < RATE).count();
        // 20 of 2000 are missed, 4.4 standard deviations are 20 more; 2 false alarms are expected, 10 are 5 deviations
        assert!(alarms(bias) >= 1960, "{} of 2000 noticed", alarms(bias));
        assert!(alarms(0.0) <= 10, "{} false alarms", alarms(0.0));
    }

    #[test]
    fn equal_numbers_pass_and_what_is_not_a_number_fails() {
        assert_eq!(ZTest::new(Moments::exact(2.0), Moments::exact(2.0)).p, 1.0);
        assert_eq!(ZTest::new(Moments::exact(2.5), Moments::exact(2.0)).p, 0.0);
        assert_eq!(ZTest::new(Moments::exact(f64::NAN), Moments::exact(2.0)).p, 0.0);
    }
}
