use restir_shared::glam::Vec3;
use restir_shared::resample::domain::{Domain, Shifted, Source};

/// Samples are numbers x in [0, 1). The pixel i wants the function `(i + 1) x` of them, whose integral is `(i + 1) / 2`.
#[derive(Debug)]
pub struct Line;

impl Domain for Line {
    type Sample = f32;
    /// The factor `i + 1` of a pixel.
    type Receiver = f32;
    /// The function's value.
    type Evaluation = f32;

    /// All pixels have the same numbers, so that a sample stays what it is, with a Jacobian of 1.
    fn shift(&self, sample: f32, _from: Source, _to: Source, _receiver: &f32) -> Shifted<f32> {
        Shifted { sample, jacobian: 1.0, exists: true }
    }
    fn evaluate(&self, receiver: &f32, sample: f32) -> f32 {
        receiver * sample
    }
    fn target(&self, evaluation: &f32) -> f32 {
        *evaluation
    }
    fn value(&self, evaluation: &f32) -> Vec3 {
        Vec3::splat(*evaluation)
    }
    /// Nothing blocks.
    fn visibility(&self, _receiver: &f32, _evaluation: &f32) -> Vec3 {
        Vec3::ONE
    }
    fn visible_target(&self, evaluation: &f32, visibility: Vec3) -> f32 {
        evaluation * visibility.x
    }
}
