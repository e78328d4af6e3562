//! The macros that make a kernel of one declaration.

/// Declares a kernel: the SPIR-V entry point, its native twin and its `KernelDesc`, from one body.
///
/// ```text
/// kernel! {
///     /// What it does.
///     pub fn shade(8, 8) {
///         constants { 0: features = 7 }          // SpecId: name = default
///         params 0: Params,                      // the first binding; implements `layout::Extent`
///         asks scene(features) { 1: geometry, 2: attributes, 3: texels },
///         read { 4: hits: UVec4 },               // any element may be read
///         own { 5: film: FilmPixel },            // one element an invocation: `film[at]`
///     }
///     |x, y, at, p, scene| film[at] = technique::shade(&scene, &p, hits, x, y)
/// }
/// ```
///
/// The body's names stand for the invocation's position, the index of its element, a copy of the parameter block and, of a
/// kernel that asks one, the scene whose header is the parameters' `scene`. The scene has the given features. With `asks frames` the name stands for
/// [`restir_shared::scene::Frames`], whose other frame has the header `other_scene`; with `asks probed` and `asks probed_frames` scenes implement
/// [`restir_shared::scene::Probe`], too, as not every scene does. Bindings are numbered from 0 without
/// gaps; the name of one is its role, by which the host binds buffers.
///
/// Natively the body runs over the arenas, or over any other scene, see `NativeRow`. Over the arenas there is a variant for
/// each set of features in `compiled [FEATURES_DIFFUSE]` after them, and the first runs that has all of the scene's.
///
/// A second body, of a whole row, runs over the arenas instead where the processor has wide registers; it gives the same results:
///
/// ```text
///     |x, y, at, p, scene| film[at] = technique::shade(&scene, &p, hits, x, y);
///     simd [FEATURES_DIFFUSE] |token|
///         technique::shade_row(&scene, &p, hits, [x, y], film, token)
/// ```
///
/// There `x` is the first invocation, and `film` has the elements of the row. It has variants of its own. After them may stand `if (p.flag == 0)`: for
/// other parameters the first body runs.
///
/// A kernel that asks a scene and traces no ray in it says so by `rays Rays::None` after it.
///
/// A kernel whose rays an embedder may trace has a second form with a name of its own, see [`restir_shared::scene::Deferred`]. It is
/// declared after the scene, with the most rays that an invocation asks for and two more bindings, the hits that are known and the
/// ray that is asked for:
///
/// ```text
///         asks scene(features) { 1: geometry, 2: attributes, 3: texels },
///         deferred shade_deferred(p.most_rays(features)) { 6: answers, 7: rays },
/// ```
macro_rules! kernel {
    (
        $(#[$doc:meta])*
        pub fn $name:ident($wx:tt, $wy:tt) {
            constants { $($constants:tt)* }
            params $pb:tt : $params:ty,
            asks $asked:ident($features:expr) { $($arenas:tt)* } $(compiled [$($compiled:tt)*])?,
            deferred $deferred:ident($most:expr) { $($extra:tt)* },
            read { $($read:tt)* },
            own { $($own:tt)* } $(,)?
        }
        |$x:ident, $y:ident, $at:ident, $p:ident, $scene:ident| $body:expr
        $(; simd $($simd:tt)*)?
    ) => {
        kernel! {
            @[$crate::Rays::Deferrable(&DEFERRED)]
            $(#[$doc])*
            pub fn $name($wx, $wy) {
                constants { $($constants)* }
                params $pb: $params,
                asks $asked($features) { $($arenas)* } $(compiled [$($compiled)*])?,
                read { $($read)* },
                own { $($own)* }
            }
            |$x, $y, $at, $p, $scene| $body
            $(; simd $($simd)*)?
        }

        deferred_kernel! {
            /// The same, whose rays somebody else traces.
            pub fn $deferred($wx, $wy) {
                constants { $($constants)* }
                params $pb: $params,
                asks $asked($features) { $($arenas)* },
                deferred($most) { $($extra)* },
                read { $($read)* },
                own { $($own)* }
            }
            |$x, $y, $at, $p, $scene| $body
        }
    };
    (
        $(#[$doc:meta])*
        pub fn $name:ident($wx:tt, $wy:tt) {
            constants { $($constants:tt)* }
            params $pb:tt : $params:ty,
            asks $asked:ident($features:expr) { $($arenas:tt)* } $(compiled [$($compiled:tt)*])?,
            rays $rays:expr,
            $($rest:tt)*
        }
        $($body:tt)*
    ) => {
        kernel! {
            @[$rays]
            $(#[$doc])*
            pub fn $name($wx, $wy) {
                constants { $($constants)* }
                params $pb: $params,
                asks $asked($features) { $($arenas)* } $(compiled [$($compiled)*])?,
                $($rest)*
            }
            $($body)*
        }
    };
    (
        @[$($rays:expr)?]
        $(#[$doc:meta])*
        pub fn $name:ident($wx:tt, $wy:tt) {
            constants { $($spec_id:tt : $spec:ident = $default:tt),* $(,)? }
            params $pb:tt : $params:ty,
            $(
                asks $asked:ident($features:expr) { $($arena_b:tt : $arena:ident),* $(,)? }
                $(compiled [$($compiled:expr),*])?,
            )?
            read { $($rb:tt : $read:ident : $rt:ty),* $(,)? },
            own { $($ob:tt : $own:ident : $ot:ty),* $(,)? } $(,)?
        }
        |$x:ident, $y:ident, $at:ident, $p:ident $(, $scene:ident)?| $body:expr
        $(; simd [$($stepped:expr),*] $(if ($when:expr))? |$token:ident| $simd:expr)?
    ) => {
        $(#[$doc])*
        #[cfg(target_arch = "spirv")]
        #[spirv_std::spirv(compute(threads($wx, $wy)))]
        pub fn $name(
            #[spirv(global_invocation_id)] id: spirv_std::glam::UVec3,
            #[spirv(storage_buffer, descriptor_set = 0, binding = $pb)] params: &$params,
            $($(
                #[spirv(storage_buffer, descriptor_set = 0, binding = $arena_b)]
                $arena: &[restir_shared::glam::UVec4],
            )*)?
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $rb)] $read: &[$rt],)*
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $ob)] $own: &mut [$ot],)*
            $(#[spirv(spec_constant(id = $spec_id, default = $default))] $spec: u32,)*
        ) {
            let $p = *params;
            let extent = restir_shared::layout::Extent::extent(&$p);
            let ($x, $y) = (id.x, id.y);
            if $x < extent[0] && $y < extent[1] {
                let $at = ($y * extent[0] + $x) as usize;
                $(let $scene = over_arenas!($asked, $p, $features, [$($arena),*], [scratch!($x, $y, $wx, $wy); 2]);)?
                $body;
            }
        }

        $(const _: () = assert!(
            $wx * $wy <= restir_shared::geometry::Scratch::INVOCATIONS,
            concat!("a workgroup that asks a ", stringify!($asked), " has more invocations than rings")
        );)?

        /// Runs one row of invocations.
        #[cfg(not(target_arch = "spirv"))]
        fn native(row: &mut $crate::NativeRow<'_>) {
            let $p: $params = *bytemuck::from_bytes(bytemuck::cast_slice(row.params));
            let mut _constants = row.constants.iter().copied();
            $(let $spec: u32 = _constants.next().unwrap_or($default);)*
            let mut _read = row.read.iter().copied();
            $($(
                let $arena: &[restir_shared::glam::UVec4] = bytemuck::cast_slice(_read.next().unwrap_or_default());
            )*)?
            $(let $read: &[$rt] = bytemuck::cast_slice(_read.next().unwrap_or_default());)*
            let mut _own = row.own.iter_mut();
            $(let $own: &mut [$ot] = _own.next().map_or(&mut [], |o| bytemuck::cast_slice_mut(o));)*
            let $y = row.y;
            over_scenes! {
                row, [$([$($stepped),*] ($($when)?) $token { let $x = row.x; $simd; })?],
                [$($scene = $asked($p, $features) [$($arena),*] [$($($compiled),*)?])?]
                for $x in row.x..row.x + row.width {
                    let $at = ($x - row.x) as usize;
                    $body;
                }
            }
        }

        /// The kernel's descriptor.
        #[cfg(not(target_arch = "spirv"))]
        pub const DESC: $crate::KernelDesc = $crate::KernelDesc {
            name: stringify!($name),
            workgroup: [$wx, $wy, 1],
            constants: &[$($crate::Constant { name: stringify!($spec), id: $spec_id, default: $default }),*],
            bindings: &[
                $crate::Binding::new::<$params>("params", $crate::Access::Params),
                $($(
                    $crate::Binding::new::<restir_shared::glam::UVec4>(stringify!($arena), $crate::Access::Read),
                )*)?
                $($crate::Binding::new::<$rt>(stringify!($read), $crate::Access::Read),)*
                $($crate::Binding::new::<$ot>(stringify!($own), $crate::Access::Own),)*
            ],
            fields: restir_shared::layout::fields_of::<$params>(),
            probes: probes!($($asked)?),
            rays: rays!([$($rays)?] $($asked)?),
            native,
        };
    };
    ($($declaration:tt)*) => {
        kernel! { @[] $($declaration)* }
    };
}

/// The form of a kernel whose rays are traced elsewhere: entry point, native twin and descriptor.
///
/// An invocation that lacks an answer leaves its own elements as they were.
macro_rules! deferred_kernel {
    (
        $(#[$doc:meta])*
        pub fn $name:ident($wx:tt, $wy:tt) {
            constants { $($spec_id:tt : $spec:ident = $default:tt),* $(,)? }
            params $pb:tt : $params:ty,
            asks $asked:ident($features:expr) { $($arena_b:tt : $arena:ident),* $(,)? },
            deferred($most:expr) { $answers_b:tt : $answers:ident, $rays_b:tt : $rays:ident $(,)? },
            read { $($rb:tt : $read:ident : $rt:ty),* $(,)? },
            own { $($ob:tt : $own:ident : $ot:ty),* $(,)? }
        }
        |$x:ident, $y:ident, $at:ident, $p:ident, $scene:ident| $body:expr
    ) => {
        $(#[$doc])*
        #[cfg(target_arch = "spirv")]
        #[spirv_std::spirv(compute(threads($wx, $wy)))]
        pub fn $name(
            #[spirv(global_invocation_id)] id: spirv_std::glam::UVec3,
            #[spirv(storage_buffer, descriptor_set = 0, binding = $pb)] params: &$params,
            $(
                #[spirv(storage_buffer, descriptor_set = 0, binding = $arena_b)]
                $arena: &[restir_shared::glam::UVec4],
            )*
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $rb)] $read: &[$rt],)*
            $(#[spirv(storage_buffer, descriptor_set = 0, binding = $ob)] $own: &mut [$ot],)*
            #[spirv(storage_buffer, descriptor_set = 0, binding = $answers_b)]
            $answers: &[restir_shared::geometry::PackedHit],
            #[spirv(storage_buffer, descriptor_set = 0, binding = $rays_b)]
            $rays: &mut [restir_shared::scene::DeferredRay],
            $(#[spirv(spec_constant(id = $spec_id, default = $default))] $spec: u32,)*
        ) {
            let $p = *params;
            let extent = restir_shared::layout::Extent::extent(&$p);
            let ($x, $y) = (id.x, id.y);
            if $x < extent[0] && $y < extent[1] {
                let $at = ($y * extent[0] + $x) as usize;
                let memory = scratch!($x, $y, $wx, $wy);
                deferred_invocation! {
                    over_arenas!($asked, $p, $features, [$($arena),*], [memory; 2]),
                    (&memory, $answers, $rays, $at, ($at as u32, extent)),
                    own [$($own),*], |$scene| $body
                }
            }
        }

        #[cfg(not(target_arch = "spirv"))]
        fn native_deferred(row: &mut $crate::NativeRow<'_>) {
            let $p: $params = *bytemuck::from_bytes(bytemuck::cast_slice(row.params));
            let mut _constants = row.constants.iter().copied();
            $(let $spec: u32 = _constants.next().unwrap_or($default);)*
            let mut read = row.read.iter().copied();
            $(let $arena: &[restir_shared::glam::UVec4] = bytemuck::cast_slice(read.next().unwrap_or_default());)*
            $(let $read: &[$rt] = bytemuck::cast_slice(read.next().unwrap_or_default());)*
            let $answers: &[restir_shared::geometry::PackedHit] = bytemuck::cast_slice(read.next().unwrap_or_default());
            let mut own = row.own.iter_mut();
            $(let $own: &mut [$ot] = own.next().map_or(&mut [], |o| bytemuck::cast_slice_mut(o));)*
            let $rays: &mut [restir_shared::scene::DeferredRay] =
                own.next().map_or(&mut [], |o| bytemuck::cast_slice_mut(o));
            let extent = restir_shared::layout::Extent::extent(&$p);
            let memory = core::cell::Cell::default();
            let $y = row.y;
            for $x in row.x..row.x + row.width {
                let $at = ($x - row.x) as usize;
                deferred_invocation! {
                    over_arenas!($asked, $p, $features, [$($arena),*], row.tracers),
                    (&memory, $answers, $rays, $at, ($y * extent[0] + $x, extent)),
                    own [$($own),*], |$scene| $body
                }
            }
        }

        #[cfg(not(target_arch = "spirv"))]
        fn most_rays(constants: &[u32], params: &[u32]) -> u32 {
            let $p: $params = *bytemuck::from_bytes(bytemuck::cast_slice(params));
            let mut constants = constants.iter().copied();
            $(let $spec: u32 = constants.next().unwrap_or($default);)*
            let _ = (&$p, $($spec),*);
            $most
        }

        /// The form of the kernel whose rays are traced elsewhere.
        #[cfg(not(target_arch = "spirv"))]
        pub const DEFERRED: $crate::DeferredKernel = $crate::DeferredKernel {
            desc: $crate::KernelDesc {
                name: stringify!($name),
                workgroup: [$wx, $wy, 1],
                constants: &[$($crate::Constant { name: stringify!($spec), id: $spec_id, default: $default }),*],
                bindings: &[
                    $crate::Binding::new::<$params>("params", $crate::Access::Params),
                    $(
                        $crate::Binding::new::<restir_shared::glam::UVec4>(stringify!($arena), $crate::Access::Read),
                    )*
                    $($crate::Binding::new::<$rt>(stringify!($read), $crate::Access::Read),)*
                    $($crate::Binding::new::<$ot>(stringify!($own), $crate::Access::Own),)*
                    $crate::DeferredKernel::ANSWERS,
                    $crate::DeferredKernel::RAYS,
                ],
                fields: restir_shared::layout::fields_of::<$params>(),
                probes: probes!($asked),
                rays: $crate::Rays::None,
                native: native_deferred,
            },
            most_rays,
        };
    };
}

/// Runs an invocation as far as its answers reach.
macro_rules! deferred_invocation {
    (
        $made:expr, ($memory:expr, $answers:ident, $rays:ident, $at:ident, ($index:expr, $extent:ident)),
        own [$($own:ident),*], |$scene:ident| $body:expr
    ) => {
        let asked = $rays[$at];
        if !asked.is_finished() {
            let known = restir_shared::scene::KnownHits {
                planes: $answers,
                index: $index,
                stride: $extent[0] * $extent[1],
                known: asked.known(),
            };
            let $scene = restir_shared::scene::Deferred::new($made, known, memory_of!($memory));
            // the body's elements, which take the place of the buffers' if they are whole
            let made = {
                let ($(mut $own,)*) = ($([$own[$at]],)*);
                let $at = 0;
                $body;
                ($($own[$at],)*)
            };
            let next = restir_shared::scene::DeferredRay::after(memory_of!($memory), known.known);
            if next.is_finished() {
                ($($own[$at],)*) = made;
            }
            $rays[$at] = next;
        }
    };
}

/// What an invocation of a deferred kernel keeps its requests in.
#[cfg(target_arch = "spirv")]
macro_rules! memory_of {
    ($memory:expr) => {
        *$memory
    };
}
#[cfg(not(target_arch = "spirv"))]
macro_rules! memory_of {
    ($memory:expr) => {
        $memory
    };
}

/// The scene, or the scene in two frames, over the arenas. Those that a kernel leaves out, because nothing that it asks lies there,
/// have the first one in their place.
macro_rules! over_arenas {
    ($asked:tt, $p:ident, $features:expr, [$geometry:ident], $tracers:expr) => {
        over_arenas!($asked, $p, $features, [$geometry, $geometry, $geometry], $tracers)
    };
    ($asked:tt, $p:ident, $features:expr, [$geometry:ident, $attributes:ident], $tracers:expr) => {
        over_arenas!($asked, $p, $features, [$geometry, $attributes, $geometry], $tracers)
    };
    (scene, $p:ident, $features:expr, [$geometry:ident, $attributes:ident, $texels:ident], $tracers:expr) => {{
        let [tracer, _]: [restir_shared::scene::Tracer<'_>; 2] = $tracers;
        let scene: restir_shared::scene::SceneView<'_> = restir_shared::scene::SceneView {
            header: $p.scene,
            geometry: $geometry,
            attributes: $attributes,
            texels: $texels,
            features: $features,
            tracer,
        };
        scene
    }};
    (probed, $($scene:tt)*) => {
        over_arenas!(scene, $($scene)*)
    };
    (probed_frames, $($frames:tt)*) => {
        over_arenas!(frames, $($frames)*)
    };
    (frames, $p:ident, $features:expr, $arenas:tt, $tracers:expr) => {{
        let tracers: [restir_shared::scene::Tracer<'_>; 2] = $tracers;
        let frames: restir_shared::scene::SceneFrames<'_> = restir_shared::scene::SceneFrames {
            this: over_arenas!(scene, $p, $features, $arenas, tracers),
            other: $p.other_scene,
            other_tracer: tracers[1],
        };
        frames
    }};
}

/// Where an invocation's traversals have their ring.
#[cfg(target_arch = "spirv")]
macro_rules! scratch {
    ($x:ident, $y:ident, $wx:tt, $wy:tt) => {
        restir_shared::geometry::Scratch { invocation: ($y % $wy) * $wx + $x % $wx }
    };
}

/// Runs a native row's loop: over the scene that the row brings, else over the arenas, in the first variant that will do.
#[cfg(not(target_arch = "spirv"))]
macro_rules! over_scenes {
    ($row:ident, $simd:tt, [] $($invocations:tt)*) => { $($invocations)* };
    (
        $row:ident, $simd:tt, [$scene:ident = $asked:ident($p:ident, $features:expr) $arenas:tt [$($compiled:expr),*]]
        $($invocations:tt)*
    ) => {
        if let Some(frames) = $row.frames {
            let $scene = over_any!($asked, frames);
            $($invocations)*
        } else {
            let scene = over_arenas!($asked, $p, $features, $arenas, $row.tracers);
            simd!($row.lanes, scene, $scene, $simd);
            over_variants!(scene, $scene, [$($compiled),*], $($invocations)*);
        }
    };
}

/// Runs the row by SIMD, and returns, if the kernel has a body for that and the row's level the registers.
#[cfg(not(target_arch = "spirv"))]
macro_rules! simd {
    ($level:expr, $all:ident, $scene:ident, []) => {};
    ($level:expr, $all:ident, $scene:ident, [$stepped:tt ($($when:expr)?) $token:ident $row:tt]) => {
        if true $(&& $when)? {
            if let Some($token) = $crate::simd::Avx512::at($level) {
                over_variants!($all, $scene, $stepped, $row return;);
            }
            if let Some($token) = $crate::simd::Avx2::at($level) {
                over_variants!($all, $scene, $stepped, $row return;);
            }
        }
    };
}

/// Tries each variant in turn, then the general one.
#[cfg(not(target_arch = "spirv"))]
macro_rules! over_variants {
    ($all:ident, $scene:ident, [], $($invocations:tt)*) => {
        let $scene = $all;
        $($invocations)*
    };
    ($all:ident, $scene:ident, [$first:expr $(, $more:expr)*], $($invocations:tt)*) => {
        if let Some($scene) = $all.within::<{ $first }>() {
            $($invocations)*
        } else {
            over_variants!($all, $scene, [$($more),*], $($invocations)*);
        }
    };
}

/// What a kernel asks of scenes behind a pointer.
#[cfg(not(target_arch = "spirv"))]
macro_rules! over_any {
    (scene, $frames:ident) => {
        $frames.scene(false)
    };
    (frames, $frames:ident) => {
        $frames
    };
    // who runs a kernel has looked whether there is one
    (probed, $frames:ident) => {
        match $frames.probed(false) {
            Some(scene) => scene,
            None => return,
        }
    };
    (probed_frames, $frames:ident) => {
        match restir_shared::scene::ProbedFrames::new($frames) {
            Some(frames) => frames,
            None => return,
        }
    };
}

/// Whether what a kernel asks needs objects.
#[cfg(not(target_arch = "spirv"))]
macro_rules! probes {
    (probed) => {
        true
    };
    (probed_frames) => {
        true
    };
    ($($asked:ident)?) => {
        false
    };
}

/// What rays a kernel traces: what its declaration says, else any, if it asks a scene.
#[cfg(not(target_arch = "spirv"))]
macro_rules! rays {
    ([$rays:expr] $($asked:ident)?) => {
        $rays
    };
    ([] $asked:ident) => {
        $crate::Rays::Internal
    };
    ([]) => {
        $crate::Rays::None
    };
}

/// Declares the modules of a folder's kernels, and the list of their descriptors.
macro_rules! kernels {
    ($($(#[$attribute:meta])* $name:ident),* $(,)?) => {
        $($(#[$attribute])* pub mod $name;)*

        /// The kernels of this folder.
        #[cfg(not(target_arch = "spirv"))]
        pub const KERNELS: &[&$crate::KernelDesc] = &[$($(#[$attribute])* &$name::DESC),*];
    };
}

/// Declares the folders, and the list of all their kernels.
macro_rules! folders {
    ($($(#[$attribute:meta])* $name:ident),* $(,)?) => {
        $($(#[$attribute])* pub mod $name;)*

        /// Every kernel, then the forms of some whose rays are traced elsewhere.
        #[cfg(not(target_arch = "spirv"))]
        pub fn all() -> Vec<&'static KernelDesc> {
            let kernels = [$($name::KERNELS),*].concat();
            let deferred = kernels.iter().filter_map(|kernel| Some(&kernel.rays.deferred()?.desc));
            kernels.iter().copied().chain(deferred).collect()
        }
    };
}
