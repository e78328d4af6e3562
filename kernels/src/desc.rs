//! What the host knows of a kernel: its descriptor and its native twin.

use crate::simd::SimdLevel;
use restir_shared::geometry::PackedHit;
use restir_shared::layout::Field;
use restir_shared::scene::{AnyFrames, DeferredRay, Tracer};
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
    /// What rays it traces.
    pub rays: Rays,
    /// Runs one row of invocations natively.
    pub native: fn(&mut NativeRow<'_>),
}

impl KernelDesc {
    /// Whether it asks for its rays ([`DeferredKernel`]).
    pub fn is_deferred(&self) -> bool {
        self.bindings.contains(&DeferredKernel::RAYS)
    }
}

/// What rays a kernel traces.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Rays {
    /// None, or not itself.
    None,
    /// It traces them itself.
    Internal,
    /// It traces them itself, and has a form whose rays are traced elsewhere.
    Deferrable(&'static DeferredKernel),
}

impl Rays {
    /// The form whose rays are traced elsewhere, if there is one.
    pub const fn deferred(&self) -> Option<&'static DeferredKernel> {
        match self {
            Self::Deferrable(kernel) => Some(kernel),
            Self::None | Self::Internal => None,
        }
    }
}

/// A kernel whose rays are traced elsewhere, see [`restir_shared::scene::Deferred`].
///
/// It has the bindings of the other form, then `answers`, in planes of a hit an invocation, and `rays`, of which it has one an invocation.
/// It runs with `rays` of zeros, then each time that the rays of a round are resolved: those of round n, from 0, into plane n.
#[derive(Clone, Copy, Debug)]
pub struct DeferredKernel {
    /// Its descriptor.
    pub desc: KernelDesc,
    /// The most rays that an invocation asks for, of the constants and the parameter block.
    pub most_rays: fn(&[u32], &[u32]) -> u32,
}

impl DeferredKernel {
    /// The binding of hits that are known.
    pub const ANSWERS: Binding = Binding::new::<PackedHit>("answers", Access::Read);
    /// The binding of rays that are asked for.
    pub const RAYS: Binding = Binding::new::<DeferredRay>("rays", Access::Own);
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
    /// The instructions for kernels that have a form for lanes. Of a level that this processor lacks, they go pixel by pixel.
    pub lanes: SimdLevel,
}

impl fmt::Debug for NativeRow<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x, y, width, constants, .. } = self;
        let mut row = f.debug_struct("NativeRow");
        row.field("x", x).field("y", y).field("width", width).field("constants", constants).finish_non_exhaustive()
    }
}
