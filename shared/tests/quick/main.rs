//! What `cargo test -p restir-shared` asks of the mathematics in a second, in a build with checks of overflow too. The suites of the workspace ask for
//! all of it.

mod mis;
mod num;
mod pack;
mod rng;
mod sampling;

/// All finite numbers with some mantissas, of both signs, zero and subnormal ones among them.
fn numbers() -> impl Iterator<Item = f32> {
    let mantissas = [0, 1, 0x00_0fff, 0x00_1000, 0x00_1001, 0x2a_aaaa, 0x40_0000, 0x55_5000, 0x7f_ffff];
    let of_exponent = move |exponent: u32| mantissas.map(|mantissa| f32::from_bits(exponent << 23 | mantissa));
    (0..255).flat_map(of_exponent).flat_map(|x| [x, -x])
}

/// Points of the unit square, at the middle of cells.
fn squares() -> impl Iterator<Item = restir_shared::glam::Vec2> {
    let at = |i: u32| (i as f32 + 0.5) / 64.0;
    (0..64).flat_map(move |y| (0..64).map(move |x| restir_shared::glam::Vec2::new(at(x), at(y))))
}
