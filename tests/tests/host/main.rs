//! What the host makes of scenes: renders, sessions, files.

mod deferred;
mod dim;
mod far;
mod foreign;
mod frames;
mod given;
mod gltf;
mod parts;
mod plans;
mod posed;
mod reported;
mod session;

restir_tests::suites! { deferred dim far foreign frames given gltf parts plans posed reported session }
