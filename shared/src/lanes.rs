//! What the host computes in step: loops over as many lanes as a register has, which a compiler turns into one pass over registers.
//!
//! The body of such a loop is the code that devices run, for one lane, so that there is one form of it and one set of bits. What keeps a
//! compiler from vectorising it are loops within, calls that are not inlined (closures often are not), and branches that end in a panic; it
//! then runs lane by lane.
//!
//! ```
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::Vec3;
//! use restir_shared::lanes::{LANES, Lanes, Registers, Stage};
//!
//! /// Points of rays at the distance 2.
//! struct Points;
//!
//! impl Stage for Points {
//!     type From = Lanes<Ray>;
//!     type To = Lanes<Vec3>;
//!
//!     fn run(&self, rays: &Lanes<Ray>, points: &mut Lanes<Vec3>) {
//!         for lane in 0..LANES {
//!             let ray = rays.get(lane);
//!             points.set(lane, ray.origin + ray.direction * 2.0);
//!         }
//!     }
//! }
//!
//! /// Those of any processor. For others, the function that runs the stage has target features.
//! #[derive(Clone, Copy)]
//! struct Any;
//!
//! impl Registers for Any {
//!     fn run<S: Stage>(self, stage: &S, from: &S::From, to: &mut S::To) {
//!         stage.run(from, to);
//!     }
//! }
//!
//! let (mut rays, mut points) = (Lanes::ZERO, Lanes::ZERO);
//! rays.set(3, Ray { origin: Vec3::X, direction: Vec3::Y, t_max: 1.0, key: 0 });
//! Any.run(&Points, &rays, &mut points);
//! assert_eq!(points.get(3), Vec3::new(1.0, 2.0, 0.0));
//! ```

use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::scene::{LightKind, LightSample, SurfacePoint};
use crate::technique::path::Walk;
use crate::transport::Chosen;
use glam::{Vec2, Vec3};

/// Lanes in step: numbers of 32 bits in a register of 512.
pub const LANES: usize = 16;

/// A function from lanes to lanes.
pub trait Stage {
    /// What it reads.
    type From;
    /// What it writes.
    type To;

    /// A loop over lanes; has to be inlined, with all that it calls. What it writes is not what it reads: a compiler gives up before it
    /// has proved of each of a hundred accesses to the same thing that it leaves the scene alone.
    fn run(&self, from: &Self::From, to: &mut Self::To);
}

/// Registers for which stages are compiled. A value of the type proves that the processor has them.
pub trait Registers: Copy {
    /// Runs a stage in a function of its own, compiled for these registers.
    fn run<S: Stage>(self, stage: &S, from: &S::From, to: &mut S::To);
}

/// What lanes may hold.
pub trait Laned: Copy {
    /// A value in each lane, by components.
    type Lanes: Copy;
    /// Zeros, which are a value of every type that counts.
    const ZERO: Self::Lanes;

    /// The value of a lane.
    fn get(lanes: &Self::Lanes, lane: usize) -> Self;

    /// Replaces the value of a lane.
    fn set(self, lanes: &mut Self::Lanes, lane: usize);
}

/// A value in each lane.
#[derive(Clone, Copy)]
pub struct Lanes<T: Laned>(T::Lanes);

impl<T: Laned> Lanes<T> {
    /// Zeros.
    pub const ZERO: Self = Self(T::ZERO);

    /// The value of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> T {
        T::get(&self.0, lane)
    }

    /// Replaces the value of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: T) {
        value.set(&mut self.0, lane);
    }
}

/// Makes lanes of a type that has one number.
macro_rules! numbers {
    ($($number:ty = $zero:expr),*) => {
        $(impl Laned for $number {
            type Lanes = [Self; LANES];
            const ZERO: [Self; LANES] = [$zero; LANES];

            #[inline(always)]
            fn get(lanes: &[Self; LANES], lane: usize) -> Self {
                lanes[lane]
            }

            #[inline(always)]
            fn set(self, lanes: &mut [Self; LANES], lane: usize) {
                lanes[lane] = self;
            }
        })*
    };
}

/// Makes lanes of a type by its fields.
macro_rules! fields {
    ($($all:ident = $one:ty { $($field:ident: $of:ty),* })*) => {
        $(
            #[doc = concat!("A `", stringify!($one), "` in each lane.")]
            #[derive(Clone, Copy)]
            pub struct $all {
                $($field: <$of as Laned>::Lanes),*
            }

            impl Laned for $one {
                type Lanes = $all;
                const ZERO: $all = $all { $($field: <$of as Laned>::ZERO),* };

                #[inline(always)]
                fn get(lanes: &$all, lane: usize) -> Self {
                    Self { $($field: <$of as Laned>::get(&lanes.$field, lane)),* }
                }

                #[inline(always)]
                fn set(self, lanes: &mut $all, lane: usize) {
                    $(self.$field.set(&mut lanes.$field, lane);)*
                }
            }
        )*
    };
}

numbers! { f32 = 0.0, u32 = 0, bool = false, LightKind = LightKind::Area }

fields! {
    Vec2s = Vec2 { x: f32, y: f32 }
    Vec3s = Vec3 { x: f32, y: f32, z: f32 }
    Rays = Ray { origin: Vec3, direction: Vec3, t_max: f32, key: u32 }
    Hits = Hit { t: f32, id: u32, uv: Vec2 }
    Choices = Chosen { pdf: f32, alone: bool }
    Walks = Walk { ray: Ray, throughput: Vec3, chosen: Chosen, depth: u32 }
    Materials = Material {
        base_color: Vec3, metallic: f32, roughness: f32, ior: f32, specular: f32, specular_color: Vec3, transmission: f32,
        diffuse_transmission: f32, diffuse_transmission_color: Vec3, thin: bool
    }
    SurfacePoints = SurfacePoint {
        position: Vec3, normal: Vec3, shading_normal: Vec3, offset: f32, material: Material, emission: Vec3, absorption: Vec3
    }
    LightSamples = LightSample {
        position: Vec3, normal: Vec3, offset: f32, emission: Vec3, two_sided: bool, density: f32, kind: LightKind,
        blended: bool, key: u32, falloff: Vec2
    }
}
