//! The scene that a command works on: from a file or built in, with what the arguments add.

use std::path::{Path, PathBuf};

use restir::advanced::memory;
use restir::scene::{Animation, Camera, Environment, MAX_COORDINATE, Scene};
use restir::shared::layout::MAX_TRIANGLES;
use restir::{Error, buffers::SceneBuffers};

use super::parse::{natural, number, require};
use super::{console, progress::patiently};

/// Image size of a scene that has none of its own, in pixels.
pub(super) const DEFAULT_SIZE: [u32; 2] = [512, 512];

/// What is added to a scene.
#[derive(Debug, clap::Args)]
pub struct Additions {
    /// Add a light above the scene.
    #[arg(long)]
    default_light: bool,
    /// Add this many small emissive triangles around the scene.
    #[arg(long, value_name = "COUNT", default_value = "0", value_parser = natural::<u32>, allow_hyphen_values = true)]
    emitters: u32,
    /// Light from all around: a latitude-longitude EXR file. It adds to the scene's lights and replaces its environment.
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    /// Factor on the radiance of --env; 1 if not given.
    #[arg(long, value_name = "FACTOR", value_parser = number::<f32>, allow_hyphen_values = true)]
    env_scale: Option<f32>,
    /// Turn of --env about +y in degrees, counter-clockwise as seen from above; 0 if not given.
    #[arg(long, value_name = "DEGREES", value_parser = number::<f64>, allow_hyphen_values = true)]
    env_rotate: Option<f64>,
    /// Fill all closed meshes that emit nothing with a medium that scatters light, as MEDIUM or MEDIUM:SCALE (`restir
    /// scenes` lists the media). SCALE is the length of a millimetre in the scene; if not given, each mesh is taken to
    /// be ten centimetres large. A colour as 0.9,0.5,0.2 is a medium, too, in which light goes a millimetre on average
    /// before it scatters.
    #[arg(long, value_name = "MEDIUM[:SCALE]", value_parser = medium)]
    subsurface: Option<(String, Option<f64>)>,
    /// Look from one point at another instead of through the scene's camera, as EYE:TARGET or EYE:TARGET:FOV: points as X,Y,Z,
    /// the vertical field of view in degrees, 40 if not given.
    #[arg(long, value_name = "CAMERA", value_parser = look, allow_hyphen_values = true)]
    camera: Option<Camera>,
    /// Radius of the camera's lens in the scene's unit of length; 0 is a pinhole.
    #[arg(long, value_name = "RADIUS", value_parser = number::<f64>, allow_hyphen_values = true)]
    aperture_radius: Option<f64>,
    /// Distance at which a camera with a lens is sharp; if not given that of the camera's target, which is 1 in a camera
    /// from glTF.
    #[arg(long, value_name = "DISTANCE", value_parser = number::<f64>, allow_hyphen_values = true)]
    focus_distance: Option<f64>,
    /// Show the scene at this time of its animation, in seconds; frames go on from there.
    #[arg(long, value_name = "TIME", value_parser = number::<f64>, allow_hyphen_values = true)]
    time: Option<f64>,
    /// Frames per second of the animation; the scene's if not given, which is 24 for a glTF file.
    #[arg(long, value_name = "RATE", value_parser = number::<f64>, allow_hyphen_values = true)]
    frame_rate: Option<f64>,
    /// Split each triangle into 4^LEVELS in the same plane: the same picture at more cost. What deforms stays as it is.
    #[arg(long, value_name = "LEVELS", default_value = "0", value_parser = natural::<u32>, allow_hyphen_values = true)]
    subdivide: u32,
}

/// More triangles take seconds to build.
const MANY_TRIANGLES: usize = 2_000_000;
/// The most triangles that --emitters adds.
const MAX_EMITTERS: u32 = 1 << 20;
/// Host memory that a triangle of a mesh takes: its indices and half a vertex.
const BYTES_PER_TRIANGLE: u64 = 30;

/// A camera from the argument of --camera.
fn look(text: &str) -> Result<Camera, String> {
    const FORM: &str = "it has to be EYE:TARGET or EYE:TARGET:FOV, as in 0,1,5:0,1,0:40";
    let numbers =
        |text: &str| text.split(',').map(|number| number.trim().parse::<f64>().ok()).collect::<Option<Vec<_>>>();
    let parts = text.split(':').map(numbers).collect::<Option<Vec<_>>>().ok_or(FORM)?;
    let parts: Vec<&[f64]> = parts.iter().map(Vec::as_slice).collect();
    let (&[ex, ey, ez], &[tx, ty, tz], degrees) = (match parts[..] {
        [eye, target] => (eye, target, 40.0),
        [eye, target, &[degrees]] => (eye, target, degrees),
        _ => return Err(FORM.to_owned()),
    }) else {
        return Err(FORM.to_owned());
    };
    let camera =
        Camera::pinhole([ex, ey, ez].into(), [tx, ty, tz].into(), [0.0, 1.0, 0.0].into(), f64::to_radians(degrees));
    camera.check().map(|()| camera)
}

/// A medium from the argument of --subsurface; whether there is one of that name is asked of the scene.
fn medium(text: &str) -> Result<(String, Option<f64>), String> {
    let (name, scale) = text.split_once(':').map_or((text, None), |(name, scale)| (name, Some(scale)));
    let number =
        |scale: &str| scale.parse().map_err(|_| format!("{scale:?} is no number; give MEDIUM or MEDIUM:SCALE"));
    Ok((name.to_owned(), scale.map(number).transpose()?))
}

/// Refuses to write over what is read.
///
/// # Errors
/// [`Error::Setting`] with the name of the output.
pub fn refuse_overwriting(
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    outputs: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<(), Error> {
    let file = |path: &Path| std::fs::canonicalize(path).ok();
    let read: Vec<PathBuf> = inputs.into_iter().filter_map(|input| file(input.as_ref())).collect();
    outputs.into_iter().try_for_each(|output| {
        let output = output.as_ref();
        let same = file(output).is_some_and(|output| read.contains(&output));
        require(!same, format_args!("the output {} is also read; name another file", output.display()))
    })
}

impl Additions {
    /// The files that [`Self::open`] reads, if they are files, but for those that a glTF document refers to: the scene knows them.
    pub fn inputs<'a>(&'a self, scene: &'a Path) -> Vec<&'a Path> {
        [scene].into_iter().chain(self.env.as_deref()).collect()
    }

    /// The scene of that name or file, with the environment.
    pub(super) fn open(&self, name_or_path: &Path) -> Result<Scene, Error> {
        patiently("reading the scene", || self.read(name_or_path))
    }

    fn read(&self, name_or_path: &Path) -> Result<Scene, Error> {
        let of_env = [("--env-scale", self.env_scale.is_some()), ("--env-rotate", self.env_rotate.is_some())];
        let unused = of_env.iter().find(|(_, given)| *given && self.env.is_none()).map(|(option, _)| option);
        require(unused.is_none(), format_args!("{} is for --env; give --env FILE", unused.unwrap_or(&"")))?;
        let mut scene = Scene::open(name_or_path)?;
        if let Some(path) = &self.env {
            let environment = Environment::load(path, &mut scene.warnings)?;
            scene.environment =
                Some(environment.placed(self.env_scale.unwrap_or(1.0), self.env_rotate.unwrap_or(0.0))?);
        }
        if let Some((medium, scale)) = &self.subsurface {
            scene.fill(medium, *scale)?;
        }
        scene.warn_of_touching_bodies();
        scene.warn_of_nested_bodies();
        scene.warn_of_dim_light();
        self.set_time(&mut scene)?;
        self.check_subdivision(&scene)?;
        Ok(scene.subdivided(self.subdivide))
    }

    fn set_time(&self, scene: &mut Scene) -> Result<(), Error> {
        let Animation { start, frame_rate, .. } = &mut scene.animation;
        (*start, *frame_rate) = (self.time.unwrap_or(*start), self.frame_rate.unwrap_or(*frame_rate));
        require(start.is_finite(), format_args!("--time {start} is no time; give a finite number"))?;
        let positive = frame_rate.is_finite() && *frame_rate > 0.0;
        require(positive, format_args!("--frame-rate {frame_rate} is out of range; give a positive number"))?;
        if scene.animation.is_still() && (self.time.is_some() || self.frame_rate.is_some()) {
            console::note("warning: nothing moves in the scene; --time and --frame-rate change nothing");
        }
        Ok(())
    }

    fn check_subdivision(&self, scene: &Scene) -> Result<(), Error> {
        if self.subdivide == 0 {
            return Ok(());
        }
        let triangles: u64 = scene.meshes.iter().map(|mesh| mesh.indices.len() as u64).sum();
        let split = triangles.saturating_mul(4_u64.saturating_pow(self.subdivide));
        let problem = format_args!(
            "--subdivide {} makes {split} triangles, more than the limit of {MAX_TRIANGLES}; give fewer levels",
            self.subdivide
        );
        require(split < u64::from(MAX_TRIANGLES), problem)?;
        memory::check(split * BYTES_PER_TRIANGLE, "the subdivided scene", "give fewer levels to --subdivide")
    }

    /// Adds the camera for an image of the given size and the light that the scene lacks, and says what the user should
    /// know about it.
    pub(super) fn complete(&self, scene: &mut Scene, [width, height]: [u32; 2]) -> Result<(), Error> {
        scene.warnings.iter().for_each(|warning| console::note(&format!("warning: {warning}")));
        let aspect = f64::from(width) / f64::from(height);
        if self.camera.is_some() {
            scene.animation.rig.release_camera();
        }
        // what a user says is in the world
        let given = self.camera.map(|camera| camera.moved(-scene.origin));
        let camera = given.or(scene.camera).unwrap_or_else(|| Camera::framing(scene.bounds(), aspect));
        scene.camera = Some(self.with_lens(camera)?);
        if self.emitters > 0 {
            let count = self.emitters;
            let problem = format_args!("{count} emitters are too many; give at most {MAX_EMITTERS}");
            require(count <= MAX_EMITTERS, problem)?;
            let camera = scene.camera_at(0.0).unwrap_or(camera);
            add_within_bounds(scene, "emitters around it", |scene| scene.add_emitters(count, &camera))?;
        }
        if self.default_light {
            add_within_bounds(scene, "a default light", Scene::add_default_light)?;
        } else if !scene.has_light() {
            console::note(
                "warning: the scene has no light, the picture will be black; --default-light or --env adds one",
            );
        }
        Ok(())
    }

    /// The buffers of the completed scene. A scene without a triangle of positive area is refused also if the default
    /// light gives it some.
    pub(super) fn buffers(&self, scene: &Scene) -> Result<SceneBuffers, Error> {
        let of =
            |instance: &restir::scene::Instance| scene.meshes.get(instance.mesh).map_or(0, |mesh| mesh.indices.len());
        let triangles: usize = scene.instances.iter().map(of).sum();
        if triangles > MANY_TRIANGLES {
            console::note(&format!("building a scene of {triangles} triangles"));
        }
        let buffers = patiently("building the scene", || SceneBuffers::build(scene))?;
        buffers.stats().warnings().iter().for_each(|warning| console::note(&format!("warning: {warning}")));
        let light = scene.meshes.last().map_or(0, |light| light.indices.len() as u64);
        if !self.default_light || buffers.stats().triangles > light {
            return Ok(buffers);
        }
        Err(Error::Scene {
            scene: scene.name.clone(),
            problem: "has no triangle with an area for the default light to shine on".to_owned(),
        })
    }

    fn with_lens(&self, camera: Camera) -> Result<Camera, Error> {
        if self.aperture_radius.is_none() && self.focus_distance.is_none() {
            return Ok(camera);
        }
        let lens_radius = self.aperture_radius.unwrap_or(camera.lens_radius);
        let camera = Camera { lens_radius, focus_distance: self.focus_distance.or(camera.focus_distance), ..camera };
        let is_sharp = self.focus_distance.is_none() || lens_radius != 0.0;
        require(is_sharp, format_args!("--focus-distance needs a lens; give --aperture-radius"))?;
        camera.check().map_err(|problem| Error::Camera { problem })?;
        Ok(camera)
    }
}

/// Adds something to a scene, which must not become too large by it.
fn add_within_bounds(scene: &mut Scene, what: &str, add: impl FnOnce(&mut Scene)) -> Result<(), Error> {
    let fits = |scene: &Scene| scene.bounds().as_flattened().iter().all(|&x| f64::from(x).abs() <= MAX_COORDINATE);
    let fitted = fits(scene);
    add(scene);
    if fitted && !fits(scene) {
        return Err(Error::Scene {
            scene: scene.name.clone(),
            problem: format!("it is too large for {what}, which would reach beyond {MAX_COORDINATE:e}; scale it down"),
        });
    }
    Ok(())
}
