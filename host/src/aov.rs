//! Layers beside the picture, for denoisers and compositors: what the camera sees, whatever the technique makes of it.
//!
//! Channels have the names that Blender gives its passes, so that its compositor finds them, and with them Open Image Denoise, which it
//! feeds with the first two. They are computed natively, and so have the same bits wherever the picture is rendered.
//!
//! Albedo and normal are means over the pixel, by camera rays that are spread as those of the picture: denoisers compare edges in them
//! with edges in the picture. The mean of two depths, positions or objects is where nothing is, so these, and motion, are of the ray
//! through the centre of the pixel and of the lens.
//!
//! ```
//! use restir_host::aov::{Aov, Shot};
//! use restir_host::technique::{Technique, path::PathSettings};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let integral = PathSettings::default().integral();
//! let shot = Shot { scene: &scene, frame: 0.0, camera: &|_| scene.camera, size: [32, 24], seed: 0, integral, samples: 1 };
//! let layers = shot.channels(&[Aov::Depth])?;
//! assert_eq!(layers[0].name, "Depth.Z");
//! assert!(layers[0].values.iter().all(|&depth| depth > 0.0));
//! # Ok::<(), Error>(())
//! ```

use crate::buffers::{SceneBuffers, owner};
use crate::exec::Progress;
use crate::image::Channel;
use crate::scene::Camera;
use crate::settings::Choice;
use crate::technique::{Integral, PixelFilter};
use crate::{Error, choices, memory};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use restir_shared::bsdf::Material;
use restir_shared::camera::{central_ray, has_lens};
use restir_shared::denoise::{Means, Samples, means};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::layout::{CameraParams, FEATURE_BLEND};
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{SceneView, Surface, SurfacePoint, Trace};
use std::fmt;

/// Most camera rays of a pixel in its means.
const MOST_SAMPLES: u32 = 64;
/// Rows between two calls of an observer.
const ROWS: usize = 16;
/// The depth of nothing, as Blender has it.
const FAR: f64 = 1.0e10;
/// Values of a pixel, over all layers.
const VALUES: usize = 18;

choices! {
    /// A layer.
    pub enum Aov {
        /// Colour of the surface in [0, 1], without light: of metal, of the diffuse part, and of what passes through it. Black where nothing is.
        "albedo" => Albedo,
        /// Shading normal in world space, on the side of the camera. Zero where nothing is, and shorter than 1 where the pixel has several.
        "normal" => Normal,
        /// Distance from the plane through the camera that is parallel to the image, in the scene's unit of length; 10^10 where nothing is.
        "depth" => Depth,
        /// Position in world space, also of a scene that was [moved near its origin](crate::scene::Scene::origin); zero where nothing is.
        "position" => Position,
        /// How the point moves in the image, in pixels to the right and up: X and Y are its place in the frame before relative to that in this
        /// one, Z and W its place in this frame relative to that in the next one.
        "motion" => Motion,
        /// Index of the object among the scene's instances, from 1 on; 0 where nothing is.
        "id" => Id,
        /// The part of a collision behind the surface that is scattered, by channel: what light below surfaces is divided by before it is
        /// denoised, and multiplied by afterwards. Black where nothing scatters.
        "scattering" => Scattering,
    }
}

impl Aov {
    /// The names of its channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo => &["Denoising Albedo.R", "Denoising Albedo.G", "Denoising Albedo.B"],
            Self::Normal => &["Denoising Normal.X", "Denoising Normal.Y", "Denoising Normal.Z"],
            Self::Depth => &["Depth.Z"],
            Self::Position => &["Position.X", "Position.Y", "Position.Z"],
            Self::Motion => &["Vector.X", "Vector.Y", "Vector.Z", "Vector.W"],
            Self::Id => &["IndexOB.X"],
            Self::Scattering => &["Scattering Albedo.R", "Scattering Albedo.G", "Scattering Albedo.B"],
        }
    }

    /// Where its values are among those of a pixel.
    fn first(self) -> usize {
        Self::ALL.iter().take_while(|other| **other != self).map(|other| other.channels().len()).sum()
    }

    fn put(self, values: &mut [f32; VALUES], these: &[f32]) {
        values[self.first()..][..these.len()].copy_from_slice(these);
    }
}

/// What layers are of.
pub struct Shot<'a> {
    /// The scene.
    pub scene: &'a SceneBuffers,
    /// The frame of its animation, which may lie between two.
    pub frame: f64,
    /// The camera of any frame.
    pub camera: &'a dyn Fn(f64) -> Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Seed of the random numbers.
    pub seed: u32,
    /// How the picture's camera rays are spread.
    pub integral: Integral,
    /// How many of them a pixel has, of which 64 are enough here.
    pub samples: u32,
}

impl fmt::Debug for Shot<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frame, size, seed, integral, samples, .. } = self;
        let mut shot = f.debug_struct("Shot");
        shot.field("frame", frame).field("size", size).field("seed", seed);
        shot.field("integral", integral).field("samples", samples).finish_non_exhaustive()
    }
}

impl Shot<'_> {
    /// The channels of the layers.
    ///
    /// # Errors
    /// [`Error::Memory`] if they do not fit, and [`Error::Scene`] if what moves goes too far away in the next frame.
    pub fn channels(&self, layers: &[Aov]) -> Result<Vec<Channel>, Error> {
        self.channels_observed(layers, &mut |_| Ok(()))
    }

    /// As [`Self::channels`]; `observe` hears of rows, and may end the work with an error.
    ///
    /// # Errors
    /// As of [`Self::channels`], and that of `observe`.
    pub fn channels_observed(
        &self,
        layers: &[Aov],
        observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    ) -> Result<Vec<Channel>, Error> {
        let [width, height] = self.size.map(|side| side as usize);
        // all values, the channels, and their encoded form
        let bytes = 3 * VALUES as u64 * 4 * width as u64 * height as u64;
        memory::check(bytes, "the layers of this image", "choose a smaller size or fewer layers")?;
        let moments = Moments::new(self, layers.contains(&Aov::Motion))?;
        let views = moments.views(self);
        let averaged = layers.iter().any(|layer| matches!(layer, Aov::Albedo | Aov::Normal | Aov::Scattering));
        let mut values = vec![[0.0; VALUES]; width * height];
        for (part, rows) in values.chunks_mut(ROWS * width).enumerate() {
            let rows_of = |(index, value): (usize, &mut [f32; VALUES])| {
                let index = part * ROWS * width + index;
                let (x, y) = ((index % width) as u32, (index / width) as u32);
                views.centre(x, y, value);
                if averaged {
                    views.means(x, y, value);
                }
            };
            rows.par_iter_mut().enumerate().for_each(rows_of);
            observe(Progress { done: ((part + 1) * ROWS).min(height) as u64, total: height as u64 })?;
        }
        let channel = |(at, &name): (usize, &&'static str)| Channel {
            name,
            values: values.iter().map(|value| value[at]).collect(),
        };
        let of_layer = |layer: &Aov| (layer.first()..).zip(layer.channels()).map(channel).collect::<Vec<_>>();
        Ok(layers.iter().flat_map(of_layer).collect())
    }
}

/// The scene in this frame, the one before and the next one; those only where something moves in it.
struct Moments {
    scenes: [Option<SceneBuffers>; 3],
}

/// Frames relative to that of a shot, the first of which is its own.
const STEPS: [f64; 3] = [0.0, -1.0, 1.0];

impl Moments {
    fn new(shot: &Shot<'_>, moves: bool) -> Result<Self, Error> {
        let mut scenes = [None, None, None];
        if shot.scene.is_animated() {
            for (scene, step) in scenes.iter_mut().zip(STEPS).take(if moves { 3 } else { 1 }) {
                *scene = Some(shot.scene.at(shot.frame + step)?);
            }
        }
        Ok(Self { scenes })
    }

    fn views<'a>(&'a self, shot: &'a Shot<'_>) -> Views<'a> {
        let features = shot.integral.features(shot.scene.features);
        let [this, before, next] = self.scenes.each_ref().map(|scene| scene.as_ref());
        let still = this.unwrap_or(shot.scene);
        let [width, height] = shot.size;
        Views {
            this: SceneView { features, ..still.traced_view() },
            others: [before, next].map(|scene| SceneView { features, ..scene.unwrap_or(still).view() }),
            cameras: STEPS.map(|step| (shot.camera)(shot.frame + step).params(width, height)),
            size: shot.size,
            seed: shot.seed,
            integral: shot.integral,
            samples: shot.samples.clamp(1, MOST_SAMPLES),
            origin: shot.scene.origin(),
        }
    }
}

/// What is seen in this frame, and of what is moved by the others.
struct Views<'a> {
    this: SceneView<'a>,
    others: [SceneView<'a>; 2],
    cameras: [CameraParams; 3],
    size: [u32; 2],
    seed: u32,
    integral: Integral,
    samples: u32,
    origin: DVec3,
}

impl Views<'_> {
    /// What there is once a pixel.
    fn centre(&self, x: u32, y: u32, values: &mut [f32; VALUES]) {
        Aov::Depth.put(values, &[FAR as f32]);
        let Some((ray, hit, point)) = self.central(x, y) else { return };
        let camera = &self.cameras[0];
        let forward = double(Vec3::from_array(camera.forward)).normalize();
        let to = double(point.position) - double(Vec3::from_array(camera.position));
        Aov::Depth.put(values, &[to.dot(forward) as f32]);
        Aov::Position.put(values, &self.in_world(point.position).to_array());
        Aov::Motion.put(values, &self.motion(&ray, &hit, &point));
        Aov::Id.put(values, &[owner(&self.this, hit.id).1 as f32 + 1.0]);
    }

    fn in_world(&self, position: Vec3) -> Vec3 {
        if self.origin == DVec3::ZERO { position } else { (double(position) + self.origin).as_vec3() }
    }

    /// What the ray through the centre of the pixel and of the lens meets.
    fn central(&self, x: u32, y: u32) -> Option<(Ray, Hit, SurfacePoint<Material>)> {
        let words = self.rng(x, y, 0).draw(0);
        let centre = Vec2::new(x as f32, y as f32) + Vec2::splat(0.5);
        let key = Ray::random_key(self.this.features, words.z);
        let ray = Ray { key, ..central_ray(&self.cameras[0], centre) };
        let hit = self.this.closest(&ray);
        hit.is_hit().then(|| (ray, hit, self.this.surface(&ray, &hit)))
    }

    /// Albedos and normal over the pixel.
    fn means(&self, x: u32, y: u32, values: &mut [f32; VALUES]) {
        let Integral { jitter, filter, .. } = self.integral;
        let camera = &self.cameras[0];
        let varies = jitter || has_lens(camera) || self.this.features & FEATURE_BLEND != 0;
        let count = if varies { self.samples } else { 1 };
        let wide = filter == PixelFilter::BlackmanHarris;
        let samples = Samples { camera, jitter, wide, sampler: Sampler::Sobol, seed: self.seed, first: 0, count };
        let Means { albedo, normal, scattering, .. } = means(&self.this, &samples, [x, y]);
        for (layer, mean) in [(Aov::Albedo, albedo), (Aov::Normal, normal), (Aov::Scattering, scattering)] {
            layer.put(values, &mean.to_array());
        }
    }

    /// Of the sampler that path tracing has by default: they are its camera rays.
    fn rng(&self, x: u32, y: u32, sample: u32) -> Rng {
        Rng::new(x, y, sample, self.seed, Sampler::Sobol)
    }

    /// Zero towards a frame in which the point is behind the camera.
    fn motion(&self, ray: &Ray, hit: &Hit, point: &SurfacePoint<Material>) -> [f32; 4] {
        let place = |camera: &CameraParams, position: Vec3| project(camera, self.size, double(position));
        let [this, before, next] = &self.cameras;
        let there = self.others.each_ref().map(|scene| scene.surface(ray, hit).position);
        let Some(now) = place(this, point.position) else { return [0.0; 4] };
        let was = place(before, there[0]).unwrap_or(now) - now;
        let will = now - place(next, there[1]).unwrap_or(now);
        [was.x, was.y, will.x, will.y].map(|pixels| pixels as f32)
    }
}

/// Where a camera sees a position, in pixels to the right and up; nowhere if it is behind.
fn project(camera: &CameraParams, [width, height]: [u32; 2], position: DVec3) -> Option<DVec2> {
    let [forward, right, up] = [camera.forward, camera.right, camera.up].map(|axis| double(Vec3::from_array(axis)));
    let to = position - double(Vec3::from_array(camera.position));
    let depth = to.dot(forward) / forward.length_squared();
    let along = |axis: DVec3| to.dot(axis) / axis.length_squared() / depth;
    let place = DVec2::new(along(right) * f64::from(width), along(up) * f64::from(height)) * 0.5;
    (depth > 0.0).then_some(place)
}

fn double(v: Vec3) -> DVec3 {
    DVec3::from_array(v.to_array().map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, builtin};
    use crate::technique::{Technique, path::PathSettings};

    const SIZE: [u32; 2] = [24, 18];

    /// The values of a layer in a frame, pixel by pixel.
    fn layer(scene: &SceneBuffers, camera: &dyn Fn(f64) -> Camera, frame: f64, layer: Aov) -> Vec<Vec<f32>> {
        let integral = PathSettings::default().integral();
        let shot = Shot { scene, frame, camera, size: SIZE, seed: 3, integral, samples: 16 };
        let channels = shot.channels(&[layer]).expect("fits");
        assert!(channels.iter().map(|channel| channel.name).eq(layer.channels().iter().copied()));
        (0..channels[0].values.len()).map(|i| channels.iter().map(|channel| channel.values[i]).collect()).collect()
    }

    fn built(name: &str) -> (Scene, SceneBuffers) {
        let scene = builtin::scene(name).expect("built in");
        let buffers = SceneBuffers::build(&scene).expect("builds");
        (scene, buffers)
    }

    fn point(values: &[f32]) -> DVec3 {
        double(Vec3::from_slice(values))
    }

    /// Positions lie behind the centres of their pixels, at the depths that are told, and on objects that there are.
    #[test]
    fn positions_and_depths_are_those_of_the_pixels() {
        let (scene, buffers) = built("cornell");
        let camera = |_| buffers.camera;
        let [positions, depths, ids] = [Aov::Position, Aov::Depth, Aov::Id].map(|of| layer(&buffers, &camera, 0.0, of));
        let forward = (buffers.camera.target - buffers.camera.position).normalize();
        let params = buffers.camera.params(SIZE[0], SIZE[1]);
        let mut objects = std::collections::BTreeSet::new();
        for (pixel, (position, depth)) in positions.iter().zip(&depths).enumerate() {
            let (x, y) = (pixel % SIZE[0] as usize, pixel / SIZE[0] as usize);
            if depth[0] == FAR as f32 {
                assert!(position.iter().all(|&x| x == 0.0) && ids[pixel][0] == 0.0);
                continue;
            }
            let place = project(&params, SIZE, point(position)).expect("in front");
            let centre = DVec2::new(x as f64 + 0.5 - 12.0, 9.0 - (y as f64 + 0.5));
            assert!((place - centre).length() < 1.0e-3, "{place} {centre}");
            let expected = (point(position) - buffers.camera.position).dot(forward);
            assert!((f64::from(depth[0]) - expected).abs() < 1.0e-5 * expected);
            objects.insert(ids[pixel][0] as usize);
        }
        assert!(objects.len() > 2 && objects.iter().all(|&id| id >= 1 && id <= scene.instances.len()), "{objects:?}");
    }

    /// A camera that goes to the right, along the image: what is at the depth d goes to the left by `width / (2 d tan(fov / 2) aspect)`
    /// pixels for a unit.
    #[test]
    fn a_camera_that_moves_moves_the_image() {
        let (_, buffers) = built("cornell");
        let Camera { position, target, up, vertical_fov, .. } = buffers.camera;
        let right = (target - position).cross(up).normalize() * 0.01;
        let camera = |frame: f64| {
            let along = right * frame;
            Camera { position: position + along, target: target + along, ..buffers.camera }
        };
        let (motions, depths) = (layer(&buffers, &camera, 5.0, Aov::Motion), layer(&buffers, &camera, 5.0, Aov::Depth));
        for (motion, depth) in motions.iter().zip(&depths).filter(|(_, depth)| depth[0] < 1.0e9) {
            let step = 0.01 * f64::from(SIZE[1]) / (2.0 * f64::from(depth[0]) * (0.5 * vertical_fov).tan());
            for (value, expected) in motion.iter().zip([step, 0.0, step, 0.0]) {
                assert!((f64::from(*value) - expected).abs() < 1.0e-4, "{motion:?} {step}");
            }
        }
    }

    /// The motion of objects, by their transforms in the three frames.
    #[test]
    fn objects_that_move_have_their_motion() {
        let (scene, buffers) = built("moving");
        let camera = |_| buffers.camera;
        let frame = 3.0;
        let [motions, positions, ids] =
            [Aov::Motion, Aov::Position, Aov::Id].map(|of| layer(&buffers, &camera, frame, of));
        let scenes = [frame, frame - 1.0, frame + 1.0].map(|frame| scene.at(frame));
        let params = buffers.camera.params(SIZE[0], SIZE[1]);
        let mut moving = 0;
        for ((motion, position), id) in motions.iter().zip(&positions).zip(&ids).filter(|(_, id)| id[0] > 0.0) {
            let [now, before, next] = scenes.each_ref().map(|scene| scene.instances[id[0] as usize - 1].transform);
            let local = now.inverse().transform_point3(point(position));
            let place = |transform: glam::DAffine3| {
                project(&params, SIZE, transform.transform_point3(local)).expect("in front")
            };
            let (was, will) = (place(before) - place(now), place(now) - place(next));
            for (value, expected) in motion.iter().zip([was.x, was.y, will.x, will.y]) {
                assert!((f64::from(*value) - expected).abs() < 1.0e-3, "{motion:?} {was} {will}");
            }
            moving += usize::from(was.length() > 0.05);
        }
        assert!(moving > 3, "{moving} pixels move");
    }

    /// What lies behind the surface scatters as the medium does, and the sky nothing.
    #[test]
    fn scattering_albedo_is_that_of_the_medium() {
        let (_, buffers) = built("slab");
        let layer = layer(&buffers, &|_| buffers.camera, 0.0, Aov::Scattering);
        assert!(layer.iter().flatten().all(|albedo| (albedo - 0.9).abs() < 1.0e-5), "{layer:?}");
        let (_, buffers) = built("cornell");
        let dark = self::layer(&buffers, &|_| buffers.camera, 0.0, Aov::Scattering);
        assert!(dark.iter().flatten().all(|&albedo| albedo == 0.0));
    }

    /// Colours and normals of walls, whose edges are mixed by the rays of a pixel.
    #[test]
    fn albedo_and_normals_are_means() {
        let (_, buffers) = built("cornell");
        let camera = |_| buffers.camera;
        let [albedos, normals] = [Aov::Albedo, Aov::Normal].map(|of| layer(&buffers, &camera, 0.0, of));
        let green = albedos.iter().filter(|color| color[1] > 2.0 * color[0] && color[1] > 2.0 * color[2]).count();
        let red = albedos.iter().filter(|color| color[0] > 2.0 * color[1] && color[0] > 2.0 * color[2]).count();
        assert!(green > 10 && red > 10, "{green} {red}");
        assert!(albedos.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
        let lengths: Vec<f64> = normals.iter().map(|normal| point(normal).length()).collect();
        let between = |low: f64, high: f64| lengths.iter().filter(|length| (low..high).contains(*length)).count();
        let [whole, mixed, longer] = [(1.0 - 1.0e-5, 1.0 + 1.0e-5), (0.1, 0.9), (1.0 + 1.0e-5, f64::INFINITY)]
            .map(|(low, high)| between(low, high));
        assert!(whole > 100 && mixed > 10 && longer == 0, "{whole} {mixed} {longer}");
    }
}
