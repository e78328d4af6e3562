//! What techniques share that reuse samples, of any kind: a technique says what a sample is, how it moves from pixel to pixel
//! and what it contributes there ([`domain`]); how reservoirs become one, and who shares with whom, is said here once.

pub mod domain;
pub mod exchange;
pub mod merge;
pub mod mis;
pub mod packed;
pub mod reproject;
pub mod reservoir;
pub mod similar;
