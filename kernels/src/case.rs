//! Parity cases: inputs on which native and device runs of a kernel are compared word by word.

use crate::KernelDesc;
use bytemuck::Pod;
use restir_shared::glam::UVec4;
use restir_shared::layout::FilmPixel;
use restir_shared::rng::{pcg4d, unit};
use std::sync::Arc;

/// One parity case: kernel, constants, grid and the contents of every buffer.
#[derive(Clone, Debug)]
pub struct Case {
    /// The kernel.
    pub kernel: &'static KernelDesc,
    /// Unique among the kernel's cases.
    pub name: String,
    /// Width and height of the grid.
    pub grid: [u32; 2],
    /// Values of the specialization constants, in the order of the descriptor.
    pub constants: Vec<u32>,
    /// Contents of every buffer in binding order; the harness fills buffers of `None` with poison.
    pub buffers: Vec<Option<Arc<[u32]>>>,
}

impl Case {
    /// A case of the general kernel over a grid of `width` by `height` invocations.
    pub fn new(kernel: &'static KernelDesc, name: impl Into<String>, width: u32, height: u32) -> Self {
        let constants = kernel.constants.iter().map(|constant| constant.default).collect();
        Self { kernel, name: name.into(), grid: [width, height], constants, buffers: Vec::new() }
    }

    /// The next buffer: a parameter block or an array.
    #[must_use]
    pub fn with<T: Pod>(mut self, data: &[T]) -> Self {
        self.buffers.push(Some(bytemuck::cast_slice(data).into()));
        self
    }

    /// The next buffer: an output, which starts out poisoned.
    #[must_use]
    pub fn output(mut self) -> Self {
        self.buffers.push(None);
        self
    }
}

/// A film plane of positive radiances over many magnitudes.
pub(crate) fn film_plane(pixels: u32, salt: u32) -> Vec<FilmPixel> {
    let value = |word: u32| unit(word) * f32::from_bits((100 + word % 40) << 23);
    (0..pixels)
        .map(|i| {
            let w = pcg4d(UVec4::new(i, salt, 0, 0));
            FilmPixel { sum: [value(w.x), value(w.y), value(w.z)], dropped: (w.w % 3) as f32 }
        })
        .collect()
}

/// Pseudo-random words.
pub(crate) fn random_words(count: u32, salt: u32) -> Vec<u32> {
    (0..count).map(|i| pcg4d(UVec4::new(i, salt, 0, 7)).x).collect()
}
