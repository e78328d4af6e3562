//! What the host knows of a kernel: its descriptor and its native twin.

use restir_shared::layout::Field;
use restir_shared::scene::{AnyFrames, Tracer};
use std::fmt;

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
#[derive(Clone, Copy, Debug)]
pub struct KernelDesc {
    /// Name of the entry point, of the module and of its file.
    pub name: &'static str,
    /// Invocations in a workgroup.
    pub workgroup: [u32; 3],
    /// Specialization constants.
    pub constants: &'static [Constant],
    /// Bindings, dense from 0.
    pub bindings: &'static [Binding],
    /// The fields of the parameter block.
    #[doc(hidden)]
    pub fields: &'static [Field],
    /// It asks for all points of an object on a segment, which a scene behind a pointer may not know.
    pub probes: bool,
    /// Runs one row of invocations natively.
    pub native: fn(&mut NativeRow<'_>),
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

impl fmt::Debug for NativeRow<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x, y, width, constants, .. } = self;
        let mut row = f.debug_struct("NativeRow");
        row.field("x", x).field("y", y).field("width", width).field("constants", constants).finish_non_exhaustive()
    }
}
