//! Distributions of random numbers, samples and reservoirs, and pictures against an independent path tracer, closed forms and quadratures.

mod filter;
mod light;
mod resampling;
mod statistics;
mod transport;

restir_tests::suites! { filter light resampling statistics transport }
