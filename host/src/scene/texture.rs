//! Textures.

use std::sync::Arc;

/// An image, filtered bilinearly or not at all.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name for messages.
    pub name: String,
    /// Width and height in texels, in 1..=16384.
    pub size: [u32; 2],
    /// RGBA, eight bits a channel, rows from the top; (0, 0) of the texture coordinates is the upper left corner. The
    /// material's slot says whether RGB is sRGB or linear.
    pub texels: Arc<[[u8; 4]]>,
    /// What lies outside [0, 1] along u and v.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: Filter,
}

/// Continuation of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// The texture repeats, and every other copy is mirrored.
    Mirror,
    /// Beyond the edge lies the texel at the edge.
    Clamp,
}

/// Interpolation of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Between the four nearest.
    #[default]
    Linear,
    /// The nearest one.
    Nearest,
}
