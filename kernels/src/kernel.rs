//! The macros that make a kernel of one declaration.

/// Declares a kernel: the SPIR-V entry point, its native twin and its `KernelDesc`, from one body.
///
/// ```text
/// kernel! {
///     /// What it does.
///     pub fn scale(64, 1) {
///         constants { 0: features = 7 }          // SpecId: name = default
///         params 0: Params,                      // the first binding; implements `layout::Extent`
///         read { 1: input: Item },               // any element may be read
///         own { 2: output: Item },               // one element an invocation: `output[at]`
///     }
///     |x, y, at, p| output[at] = technique::scale(&p, input, x, y)
/// }
/// ```
///
/// The body's names stand for the invocation's position, the index of its element, and a copy of the parameter block;
/// a kernel that traces rays names a fifth, the [`restir_shared::scene::Tracer`], and one that traces them in the scene of
/// another frame a sixth, the tracer of that. Bindings are numbered from 0 without gaps. A function
/// `cases(&dyn CaseScenes) -> Vec<Case>` in the same file gives the parity cases.
macro_rules! kernel {
    (
        $(#[$doc:meta])*
        pub fn $name:ident($wx:tt, $wy:tt) {
            constants { $($spec_id:tt : $spec:ident = $default:tt),* $(,)? }
            params $pb:tt : $params:ty,
            read { $($rb:tt : $read:ident : $rt:ty),* $(,)? },
            own { $($ob:tt : $own:ident : $ot:ty),* $(,)? } $(,)?
        }
        |$x:ident, $y:ident, $at:ident, $p:ident $(, $tracer:ident $(, $other_tracer:ident)?)?| $body:expr
    ) => {
        $(#[$doc])*
        #[cfg(target_arch = "spirv")]
        #[spirv_std::spirv(compute(threads($wx, $wy)))]
        pub fn $name(
            #[spirv(global_invocation_id)] id: spirv_std::glam::UVec3,
            #[spirv(storage_buffer, descriptor_set = 0, binding = $pb)] params: &$params,
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $rb)] $read: &[$rt],)*
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $ob)] $own: &mut [$ot],)*
            $(#[spirv(spec_constant(id = $spec_id, default = $default))] $spec: u32,)*
        ) {
            let $p = *params;
            let extent = restir_shared::layout::Extent::extent(&$p);
            let ($x, $y) = (id.x, id.y);
            $(
                let $tracer = restir_shared::scene::Tracer::default();
                $(let $other_tracer = restir_shared::scene::Tracer::default();)?
            )?
            if $x < extent[0] && $y < extent[1] {
                let $at = ($y * extent[0] + $x) as usize;
                $body;
            }
        }

        /// Runs one row of invocations.
        #[cfg(not(target_arch = "spirv"))]
        fn native(row: &mut $crate::NativeRow<'_>) {
            let $p: $params = *bytemuck::from_bytes(bytemuck::cast_slice(row.params));
            let mut _constants = row.constants.iter().copied();
            $(let $spec: u32 = _constants.next().unwrap_or($default);)*
            let mut _read = row.read.iter().copied();
            $(let $read: &[$rt] = bytemuck::cast_slice(_read.next().unwrap_or_default());)*
            let mut _own = row.own.iter_mut();
            $(let $own: &mut [$ot] = _own.next().map_or(&mut [], |o| bytemuck::cast_slice_mut(o));)*
            $(
                let $tracer = row.tracer;
                $(let $other_tracer = row.other_tracer;)?
            )?
            let $y = row.y;
            for $x in 0..row.width {
                let $at = $x as usize;
                $body;
            }
        }

        /// The kernel's descriptor.
        #[cfg(not(target_arch = "spirv"))]
        pub const DESC: $crate::KernelDesc = $crate::KernelDesc {
            name: stringify!($name),
            workgroup: [$wx, $wy, 1],
            constants: &[$($crate::Constant { name: stringify!($spec), id: $spec_id, default: $default }),*],
            bindings: &[
                $crate::Binding {
                    name: "params",
                    access: $crate::Access::Params,
                    stride: size_of::<$params>() as u32,
                },
                $($crate::Binding {
                    name: stringify!($read),
                    access: $crate::Access::Read,
                    stride: size_of::<$rt>() as u32,
                },)*
                $($crate::Binding {
                    name: stringify!($own),
                    access: $crate::Access::Own,
                    stride: size_of::<$ot>() as u32,
                },)*
            ],
            native,
            cases,
        };
    };
}

/// A value computed from a scene. Natively there is a variant of the code for each of the given sets of features, and the
/// first runs that has all of the scene's; a device has only the general one, which is specialised when it is loaded.
///
/// ```text
/// film[at] = variants!(scene in [FEATURES_DIFFUSE] => technique::path::pixel(&scene, &p, x, y))
/// ```
macro_rules! variants {
    ($scene:ident in [$($features:expr),*] => $value:expr) => {{
        #[cfg(target_arch = "spirv")]
        let value = $value;
        #[cfg(not(target_arch = "spirv"))]
        let value = $(if let Some($scene) = $scene.within::<{ $features }>() { $value } else)* { $value };
        value
    }};
}

/// Declares the kernels' modules and the list of their descriptors.
macro_rules! kernels {
    ($($(#[$attribute:meta])* $name:ident),* $(,)?) => {
        $($(#[$attribute])* pub mod $name;)*

        /// Every kernel.
        #[cfg(not(target_arch = "spirv"))]
        pub const ALL: &[KernelDesc] = &[$($(#[$attribute])* $name::DESC),*];
    };
}
