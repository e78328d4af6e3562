//! What the host knows of a kernel: its descriptor, its native twin, its parity cases.

use bytemuck::Pod;
use restir_shared::layout::{CameraParams, SceneHeader};
use restir_shared::scene::{AnyFrames, Tracer};

/// How a kernel uses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// One parameter block, read by all invocations.
    Params,
    /// An array that any invocation may read anywhere.
    Read,
    /// An array with one element an invocation, which only that invocation reads and writes.
    Own,
}

/// A storage buffer of a kernel. Its index in [`KernelDesc::bindings`] is its binding number in set 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name, as in the kernel's declaration: the role of the buffer that is bound.
    pub name: &'static str,
    /// How the kernel uses it.
    pub access: Access,
    /// Size of an element (of the block for [`Access::Params`]) in bytes.
    pub stride: u32,
}

impl Binding {
    /// A binding of elements, or of a block, of type `T`.
    pub const fn new<T>(name: &'static str, access: Access) -> Self {
        Self { name, access, stride: size_of::<T>() as u32 }
    }
}

/// A specialization constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Constant {
    /// Name, as in the kernel's declaration.
    pub name: &'static str,
    /// `SpecId` in the SPIR-V module.
    pub id: u32,
    /// Value when it is not frozen.
    pub default: u32,
}

/// Everything that the host needs to run a kernel on either side.
///
/// It is written by the `kernel!` macro; `cargo xtask shader check` compares it with the compiled module.
#[derive(Clone, Copy)]
pub struct KernelDesc {
    /// Name of the entry point, of the module and of its file.
    pub name: &'static str,
    /// Invocations in a workgroup.
    pub workgroup: [u32; 3],
    /// Specialization constants.
    pub constants: &'static [Constant],
    /// Bindings, dense from 0.
    pub bindings: &'static [Binding],
    /// Runs one row of invocations natively.
    pub native: fn(&mut NativeRow<'_>),
    /// Inputs on which native and device runs are compared word by word.
    pub cases: fn(&dyn CaseScenes) -> Vec<Case>,
}

/// A row of the grid or a part of it, for the native twin: `y` is fixed, and x runs over the row.
pub struct NativeRow<'a> {
    /// Where in the row the first invocation is.
    pub x: u32,
    /// The row.
    pub y: u32,
    /// Number of invocations.
    pub width: u32,
    /// Values of the specialization constants, in the order of the descriptor.
    pub constants: &'a [u32],
    /// The parameter block.
    pub params: &'a [u32],
    /// The [`Access::Read`] arrays, whole, in the order of the descriptor.
    pub read: &'a [&'a [u32]],
    /// The row's part of the [`Access::Own`] arrays, in the order of the descriptor.
    pub own: &'a mut [&'a mut [u32]],
    /// What traces rays instead of the geometry arena, in the scene of this frame and in that of the other one.
    pub tracers: [Tracer<'a>; 2],
    /// What a kernel asks instead of a scene in its arenas.
    pub frames: Option<&'a dyn AnyFrames>,
}

/// A scene that cases may use: header and arenas as kernels see them.
pub struct CaseScene {
    /// Where the tables are.
    pub header: SceneHeader,
    /// Where those of the frame before are; the same ones if the scene stands still.
    pub other_header: SceneHeader,
    /// Geometry arena.
    pub geometry: Vec<u32>,
    /// Attribute arena.
    pub attributes: Vec<u32>,
    /// Texel arena.
    pub texels: Vec<u32>,
    /// The camera's parameters for an image of the given width and height.
    pub camera: Box<dyn Fn(u32, u32) -> CameraParams>,
    /// The scene's feature bits.
    pub features: u32,
}

/// Gives the built-in scenes to the cases; this crate cannot build a BVH.
pub trait CaseScenes {
    /// The built-in scene of that name; as `moving 5`, that frame of an animated one, with the frame before.
    fn scene(&self, name: &str) -> CaseScene;
}

/// One parity case: constants, grid and the contents of every buffer.
#[derive(Clone, Debug)]
pub struct Case {
    /// Unique among the kernel's cases.
    pub name: String,
    /// Width and height of the grid.
    pub grid: [u32; 2],
    /// Frozen specialization constants: (index in the descriptor, value).
    pub constants: Vec<(usize, u32)>,
    /// Contents of every buffer in binding order; the harness fills buffers of `None` with poison.
    pub buffers: Vec<Option<Vec<u32>>>,
}

impl Case {
    /// A case over a grid of `width` by `height` invocations.
    pub fn new(name: impl Into<String>, width: u32, height: u32) -> Self {
        Self { name: name.into(), grid: [width, height], constants: Vec::new(), buffers: Vec::new() }
    }

    /// Freezes the constant with the given index in the descriptor.
    #[must_use]
    pub fn freeze(mut self, index: usize, value: u32) -> Self {
        self.constants.push((index, value));
        self
    }

    /// The next buffer: a parameter block or an array.
    #[must_use]
    pub fn with<T: Pod>(mut self, data: &[T]) -> Self {
        self.buffers.push(Some(bytemuck::cast_slice(data).to_vec()));
        self
    }

    /// The next buffer: an output, which starts out poisoned.
    #[must_use]
    pub fn output(mut self) -> Self {
        self.buffers.push(None);
        self
    }
}
