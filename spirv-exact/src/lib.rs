#![doc = include_str!("../README.md")]

pub mod allow;
pub mod canonical;
pub mod module;
pub mod post;
