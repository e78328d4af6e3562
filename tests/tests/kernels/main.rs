//! Kernels: the same bits on every adapter, by SIMD and with any features, and what shows that a difference would be seen.

mod compact;
mod contract;
mod fast;
mod features;
mod in_step;
mod liveness;
mod parity;

restir_tests::suites! { compact contract fast features in_step liveness parity }
