//! The mathematics of restir-shared, and the order of its modules and of all others.

mod architecture;
mod bsdf;
mod conditional;
mod diffusion;
mod geometry;
mod media;
mod num;
mod vec;

restir_tests::suites! { architecture bsdf conditional diffusion geometry media num vec }
