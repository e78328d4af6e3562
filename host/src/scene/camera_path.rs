//! A camera that moves from frame to frame.

use std::io::Read;
use std::path::Path;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Deserializer};

use super::Camera;
use crate::error::{Cause, ensure, explained};
use crate::{Error, input};

/// What an orbit and a pan turn by in a frame, in degrees.
const DEGREES_A_FRAME: f64 = 1.0;
/// The largest file that is read.
const MAX_BYTES: u64 = 1 << 24;
/// The fields of a keyframe, all of them needed.
const FIELDS: &str = r#"{"frame": 0, "position": [x, y, z], "target": [x, y, z], "fov": degrees}"#;

/// Where the camera is in each frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CameraPath {
    /// Around the target about the camera's up vector, a degree a frame.
    Orbit,
    /// Around the target about the camera's up vector, once in so many frames.
    Turntable(u32),
    /// Turning about the camera's up vector, a degree a frame.
    Pan,
    /// Between keyframes, in straight lines; it stays at the last one.
    Keyframes(Vec<Keyframe>),
}

/// The camera in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Index of the frame.
    pub frame: f64,
    /// Where the camera is.
    #[serde(deserialize_with = "vector")]
    pub position: DVec3,
    /// What it looks at.
    #[serde(deserialize_with = "vector")]
    pub target: DVec3,
    /// Vertical field of view in radians; a file has it in degrees.
    #[serde(rename = "fov", deserialize_with = "radians")]
    pub vertical_fov: f64,
}

impl CameraPath {
    /// `orbit`, `pan`, or a JSON file: an array of keyframes `{"frame", "position", "target", "fov"}`, frames ascending,
    /// the field of view in degrees.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read or is no camera path.
    pub fn open(name_or_file: &Path) -> Result<Self, Error> {
        match name_or_file.to_str() {
            Some("orbit") => Ok(Self::Orbit),
            Some("pan") => Ok(Self::Pan),
            _ => read(name_or_file).map_err(|cause| {
                let sentence = format!("{cause}; a camera path is orbit, pan or a JSON array of {FIELDS}");
                Error::cannot_read(name_or_file, explained(sentence, cause))
            }),
        }
    }

    /// The path elsewhere. Keyframes in coordinates of the world are those of a scene if they are moved by minus [`Scene::origin`];
    /// what goes around a target or turns does so anywhere.
    ///
    /// [`Scene::origin`]: super::Scene::origin
    #[must_use]
    pub fn moved(mut self, step: DVec3) -> Self {
        if let Self::Keyframes(keys) = &mut self {
            for key in keys {
                key.position += step;
                key.target += step;
            }
        }
        self
    }

    /// The cameras of the first `frames` frames; `camera` is the scene's, whose up vector and lens stay.
    ///
    /// # Errors
    /// [`Error::Camera`] for one that [`Camera::check`] refuses.
    pub fn cameras(&self, camera: Camera, frames: u32) -> Result<Vec<Camera>, Error> {
        let checked = |frame: u32| {
            let camera = self.at(camera, f64::from(frame));
            let refused = |problem| Error::Camera { problem: format!("frame {frame} of the camera path: {problem}") };
            camera.check().map(|()| camera).map_err(refused)
        };
        (0..frames).map(checked).collect()
    }

    /// The camera in a frame, which may lie before the first one.
    pub fn at(&self, camera: Camera, frame: f64) -> Camera {
        let degrees = match self {
            Self::Turntable(frames) => frame * 360.0 / f64::from(*frames),
            _ => frame * DEGREES_A_FRAME,
        };
        let turn = DQuat::from_axis_angle(camera.up.normalize_or(DVec3::Y), degrees.to_radians());
        match self {
            Self::Orbit | Self::Turntable(_) => {
                Camera { position: camera.target + turn * (camera.position - camera.target), ..camera }
            }
            Self::Pan => Camera { target: camera.position + turn * (camera.target - camera.position), ..camera },
            Self::Keyframes(keys) => {
                let next = keys.partition_point(|key| key.frame <= frame);
                let (a, b) = (keys[next.saturating_sub(1)], keys[next.min(keys.len() - 1)]);
                let t = if b.frame > a.frame { ((frame - a.frame) / (b.frame - a.frame)).max(0.0) } else { 0.0 };
                Camera {
                    position: a.position.lerp(b.position, t),
                    target: a.target.lerp(b.target, t),
                    vertical_fov: a.vertical_fov + (b.vertical_fov - a.vertical_fov) * t,
                    ..camera
                }
            }
        }
    }
}

fn read(path: &Path) -> Result<CameraPath, Cause> {
    let mut text = String::new();
    input::open(path).and_then(|file| file.take(MAX_BYTES).read_to_string(&mut text))?;
    let keys: Vec<Keyframe> =
        serde_json::from_str(&text).map_err(|error| explained(format!("it is no camera path: {error}"), error))?;
    ensure!(!keys.is_empty(), "it has no keyframe");
    ensure!(keys.is_sorted_by(|a, b| a.frame < b.frame), "its frames do not ascend");
    Ok(CameraPath::Keyframes(keys))
}

fn radians<'de, D: Deserializer<'de>>(degrees: D) -> Result<f64, D::Error> {
    f64::deserialize(degrees).map(f64::to_radians)
}

fn vector<'de, D: Deserializer<'de>>(numbers: D) -> Result<DVec3, D::Error> {
    <[f64; 3]>::deserialize(numbers).map(DVec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn camera() -> Camera {
        Camera::pinhole(DVec3::new(0.0, 1.0, 4.0), DVec3::Y, DVec3::Y, 0.7)
    }

    fn file(text: &str) -> Result<CameraPath, Error> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        CameraPath::open(file.path())
    }

    #[test]
    fn orbits_and_pans_keep_their_distance() {
        for path in [CameraPath::Orbit, CameraPath::Pan] {
            let cameras = path.cameras(camera(), 91).unwrap();
            assert_eq!(cameras[0], camera());
            assert!(cameras.iter().all(|c| ((c.position - c.target).length() - 4.0).abs() < 1e-9));
            let across = (cameras[90].position - cameras[90].target).normalize();
            assert!(across.dot(DVec3::Z).abs() < 1e-9, "{path:?} has turned by a right angle");
        }
    }

    #[test]
    fn a_turntable_turns_once() {
        let cameras = CameraPath::Turntable(8).cameras(camera(), 9).unwrap();
        assert!((cameras[8].position - cameras[0].position).length() < 1e-9);
        assert!((cameras[4].position - DVec3::new(0.0, 1.0, -4.0)).length() < 1e-9);
        assert!(cameras.windows(2).all(|pair| (pair[0].position - pair[1].position).length() > 3.0));
    }

    #[test]
    fn keyframes_are_joined_by_straight_lines() {
        let path = file(
            r#"[{"frame": 1, "position": [0, 0, 4], "target": [0, 0, 0], "fov": 40},
                {"frame": 3, "position": [2, 0, 4], "target": [0, 0, 0], "fov": 60}]"#,
        );
        let cameras = path.unwrap().cameras(camera(), 6).unwrap();
        let x: Vec<f64> = cameras.iter().map(|c| c.position.x).collect();
        assert_eq!(x, [0.0, 0.0, 1.0, 2.0, 2.0, 2.0]);
        assert!((cameras[2].vertical_fov.to_degrees() - 50.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let key = r#""position": [0, 0, 4], "target": [0, 0, 0], "fov": 40"#;
        for (text, word) in [
            ("", "no camera path"),
            ("[]", "no keyframe"),
            ("[{}]", "frame"),
            (r#"[{"frame": 0}]"#, "position"),
            (r#"[{"frame": 1e999}]"#, "number out of range"),
            (&format!(r#"[{{"frame": 1, {key}}}, {{"frame": 1, {key}}}]"#), "ascend"),
        ] {
            let message = file(text).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("orbit"), "{message}");
        }
        CameraPath::open(Path::new("/no/such/file")).unwrap_err();
        let same = r#"[{"frame": 0, "position": [1, 1, 1], "target": [1, 1, 1], "fov": 40}]"#;
        file(same).unwrap().cameras(camera(), 1).unwrap_err();
        for fov in ["0", "-10", "180", "1e308"] {
            let text = format!(r#"[{{"frame": 0, "position": [0, 0, 4], "target": [0, 0, 0], "fov": {fov}}}]"#);
            let message = file(&text).unwrap().cameras(camera(), 1).unwrap_err().to_string();
            assert!(message.contains("field of view"), "{message}");
        }
    }
}
