//! Probes of the scalar functions that `self_check` leaves out, of colour and of packed formats. Apart from it, because
//! that one is compiled and run whenever a device is opened.

use super::Probes;
use super::operands::NumOperands;
use restir_shared::glam::Vec3;
use restir_shared::num::{self, eft};
use restir_shared::{color, pack};

/// Results of a probe.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct NumResults {
    /// 2^x.
    pub exp2: f32,
    /// e^x - 1.
    pub expm1: f32,
    /// log2 x.
    pub log2: f32,
    /// ln(1 + x).
    pub ln_1p: f32,
    /// sinh x.
    pub sinh: f32,
    /// arsinh x.
    pub asinh: f32,
    /// arccos x in turns.
    pub acos: f32,
    /// arcsin x in turns.
    pub asin: f32,
    /// The cube root of x.
    pub cbrt: f32,
    /// x^y.
    pub pow: f32,
    /// x rounded down.
    pub floor: f32,
    /// The difference of two products.
    pub difference_of_products: f32,
    /// The compensated sum of all factors and the first again.
    pub sum: f32,
    /// The sRGB value of x.
    pub srgb_encode: f32,
    /// The light of the sRGB value x.
    pub srgb_decode: f32,
    /// The code of the direction (x, y, z).
    pub direction_code: u32,
    /// The direction of the word.
    pub direction: [f32; 3],
    /// x and y as halves.
    pub halves: u32,
    /// The halves of the word.
    pub from_halves: [f32; 2],
    /// The code of the colour (x, y, z).
    pub colour_code: u32,
    /// The colour of the word.
    pub colour: [f32; 3],
    /// x with 8 bits.
    pub unorm8: u32,
    /// x with 16 bits.
    pub unorm16: u32,
    /// The last 16 bits of the word as a number up to 1.
    pub from_unorm16: f32,
}

fn probe(o: NumOperands) -> NumResults {
    let [a, b, c, d] = o.factors;
    let vector = Vec3::new(o.x, o.y, o.z);
    let direction = pack::decode_unit_vector(o.word);
    let colour = pack::rgb9e5_decode(o.word);
    let (first, second) = pack::f32_from_half2(o.word);
    NumResults {
        exp2: num::exp2(o.x),
        expm1: num::expm1(o.x),
        log2: num::log2(o.x),
        ln_1p: num::ln_1p(o.x),
        sinh: num::sinh(o.x),
        asinh: num::asinh(o.x),
        acos: num::acos(o.x),
        asin: num::asin(o.x),
        cbrt: num::cbrt(o.x),
        pow: num::pow(o.x, o.y),
        floor: num::floor(num::flush(o.x)),
        difference_of_products: eft::difference_of_products(a, b, c, d),
        sum: eft::Sum::new(a, b).plus(c).plus(d).plus(-a).total(),
        srgb_encode: color::srgb_encode(o.x),
        srgb_decode: color::srgb_decode(o.x),
        direction_code: pack::encode_unit_vector(vector),
        direction: [direction.x, direction.y, direction.z],
        halves: pack::half2_from_f32(o.x, o.y),
        from_halves: [first, second],
        colour_code: pack::rgb9e5_encode(vector),
        colour: [colour.x, colour.y, colour.z],
        unorm8: pack::UNORM8.encode(o.x),
        unorm16: pack::UNORM16.encode(o.x),
        from_unorm16: pack::UNORM16.decode(o.word & 0xffff),
    }
}

kernel! {
    /// Evaluates one probe an invocation.
    pub fn num_probe(64, 1) {
        constants {}
        params 0: Probes,
        read { 1: operands: NumOperands },
        own { 2: results: NumResults },
    }
    |x, _y, at, _p| results[at] = probe(operands[x as usize])
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    super::probes(&DESC, [("boundaries", super::inputs::num_boundaries()), ("random", super::inputs::num_random(8192))])
}
