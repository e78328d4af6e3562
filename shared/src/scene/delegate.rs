//! Types that hold a scene and answer as it does.

/// Implements [`Surface`](super::Surface) for a type that holds the scene `S`, by what `S` answers: `delegate_surfaces!([?Sized] &S, self => **self)`.
macro_rules! delegate_surfaces {
    ([$($lifetime:lifetime)? $(? $unsized:ident)?] $holder:ty, $self:ident => $scene:expr) => {
        impl<$($lifetime,)? S: $crate::scene::Surface $(+ ?$unsized)?> $crate::scene::Surface for $holder {
            type Material = S::Material;

            #[inline(always)]
            fn surface(
                &$self,
                ray: &$crate::geometry::Ray,
                hit: &$crate::geometry::Hit,
            ) -> $crate::scene::SurfacePoint<S::Material> {
                $scene.surface(ray, hit)
            }

            #[inline(always)]
            fn location(&$self, hit: &$crate::geometry::Hit) -> $crate::scene::Location {
                $scene.location(hit)
            }

            #[inline(always)]
            fn off_edges(&$self, hit: &$crate::geometry::Hit) -> $crate::geometry::Hit {
                $scene.off_edges(hit)
            }

            #[inline(always)]
            fn sheet(
                &$self,
                ray: &$crate::geometry::Ray,
                hit: &$crate::geometry::Hit,
            ) -> $crate::scene::SurfacePoint<S::Material> {
                $scene.sheet(ray, hit)
            }

            #[inline(always)]
            fn interior(&$self, hit: &$crate::geometry::Hit) -> $crate::medium::Interior {
                $scene.interior(hit)
            }

            #[inline(always)]
            fn absorbed(&$self, hit: &$crate::geometry::Hit) -> glam::Vec3 {
                $scene.absorbed(hit)
            }

            #[inline(always)]
            fn features(&$self) -> u32 {
                $scene.features()
            }
        }
    };
}
pub(super) use delegate_surfaces;

/// The same of [`Lights`](super::Lights) and [`AddressedLights`](super::AddressedLights).
macro_rules! delegate_lights {
    ([$($lifetime:lifetime)? $(? $unsized:ident)?] $holder:ty, $self:ident => $scene:expr) => {
        impl<$($lifetime,)? S: $crate::scene::Lights $(+ ?$unsized)?> $crate::scene::Lights for $holder {
            #[inline(always)]
            fn sample_light(&$self, words: glam::UVec4) -> $crate::scene::LightSample {
                $scene.sample_light(words)
            }

            #[inline(always)]
            fn light_density(&$self, hit: &$crate::geometry::Hit) -> f32 {
                $scene.light_density(hit)
            }

            #[inline(always)]
            fn environment(&$self, direction: glam::Vec3) -> $crate::scene::EnvironmentPoint {
                $scene.environment(direction)
            }
        }

        impl<$($lifetime,)? S: $crate::scene::AddressedLights $(+ ?$unsized)?> $crate::scene::AddressedLights for $holder {
            #[inline(always)]
            fn choose_address(&$self, words: glam::UVec4) -> $crate::scene::LightAddress {
                $scene.choose_address(words)
            }

            #[inline(always)]
            fn light_at(&$self, address: $crate::scene::LightAddress) -> $crate::scene::AddressedLight {
                $scene.light_at(address)
            }

            #[inline(always)]
            fn address_of_hit(&$self, hit: &$crate::geometry::Hit) -> $crate::scene::LightAddress {
                $scene.address_of_hit(hit)
            }

            #[inline(always)]
            fn address_of_environment(&$self, direction: glam::Vec3) -> $crate::scene::LightAddress {
                $scene.address_of_environment(direction)
            }
        }
    };
}
pub(super) use delegate_lights;
