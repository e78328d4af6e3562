//! What the host makes of scenes: renders, sessions, files.

mod foreign;
mod frames;
mod gltf;
mod posed;
mod session;

restir_tests::suites! { foreign frames gltf posed session }
