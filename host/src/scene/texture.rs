//! Textures.

use std::sync::Arc;

/// An image, filtered bilinearly or not at all.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name for messages.
    pub name: String,
    /// Width and height in texels, in 1..=16384.
    pub size: [u32; 2],
    /// Rows from the top; (0, 0) of the texture coordinates is the upper left corner. The material's slot says whether RGB is sRGB
    /// or linear.
    pub texels: Texels,
    /// What lies outside [0, 1] along u and v.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: Filter,
}

/// The texels of a texture: RGBA, whose largest code stands for 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Eight bits a channel.
    Eight(Arc<[[u8; 4]]>),
    /// Sixteen bits a channel, which take twice the memory.
    Sixteen(Arc<[[u16; 4]]>),
}

impl Texels {
    /// The same texels at eight bits a channel, if those hold them.
    pub fn new(texels: Vec<[u16; 4]>) -> Self {
        let eight = |channel: u16| (channel / 257) as u8;
        if texels.as_flattened().iter().all(|channel| channel % 257 == 0) {
            Self::Eight(texels.iter().map(|texel| texel.map(eight)).collect())
        } else {
            Self::Sixteen(texels.into())
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Eight(texels) => texels.len(),
            Self::Sixteen(texels) => texels.len(),
        }
    }

    /// A texel at sixteen bits a channel.
    ///
    /// # Panics
    /// From [`Self::count`] on.
    pub fn at(&self, index: usize) -> [u16; 4] {
        match self {
            Self::Eight(texels) => texels[index].map(|channel| 257 * u16::from(channel)),
            Self::Sixteen(texels) => texels[index],
        }
    }

    /// All texels, as [`Self::at`] has them.
    pub fn iter(&self) -> impl Iterator<Item = [u16; 4]> {
        (0..self.count()).map(|index| self.at(index))
    }

    /// Bytes in memory.
    pub(crate) fn bytes(&self) -> u64 {
        let channel = if self.is_fine() { 2 } else { 1 };
        4 * channel * self.count() as u64
    }

    /// Whether they have sixteen bits a channel.
    pub(crate) fn is_fine(&self) -> bool {
        matches!(self, Self::Sixteen(_))
    }

    /// Whether both are the same place in memory.
    #[cfg(feature = "gltf")]
    pub(crate) fn is_shared(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Eight(a), Self::Eight(b)) => Arc::ptr_eq(a, b),
            (Self::Sixteen(a), Self::Sixteen(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl FromIterator<[u8; 4]> for Texels {
    fn from_iter<T: IntoIterator<Item = [u8; 4]>>(texels: T) -> Self {
        Self::Eight(texels.into_iter().collect())
    }
}

impl<const N: usize> From<[[u8; 4]; N]> for Texels {
    fn from(texels: [[u8; 4]; N]) -> Self {
        texels.into_iter().collect()
    }
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
