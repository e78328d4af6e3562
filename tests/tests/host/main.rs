//! What the host makes of scenes: renders, sessions, files.

mod far;
mod foreign;
mod frames;
mod gltf;
mod posed;
mod session;

restir_tests::suites! { far foreign frames gltf posed session }
