//! How a scene changes with time.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};

use super::{Camera, Rig, Scene};

/// How a scene changes with time. Triangles, materials' textures and the number of everything stay; what is not named here
/// stands still.
///
/// All times below have the same unit, of which [`Self::frame_rate`] frames make one: frames themselves unless set
/// otherwise, seconds in a scene from glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Nodes, skins and morph targets: where things are, before their motions.
    pub rig: Rig,
    /// Instances that move, each at most once.
    pub motions: Vec<Motion>,
    /// When emitters do not shine.
    pub blackouts: Vec<Blackout>,
    /// After this time everything begins anew; `None` for once.
    pub period: Option<f64>,
    /// The time of frame 0.
    pub start: f64,
    /// Frames in a unit of time, positive.
    pub frame_rate: f64,
}

impl Default for Animation {
    /// Nothing ever changes.
    fn default() -> Self {
        Self {
            rig: Rig::default(),
            motions: Vec::new(),
            blackouts: Vec::new(),
            period: None,
            start: 0.0,
            frame_rate: 1.0,
        }
    }
}

/// The motion of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Index into [`Scene::instances`].
    pub instance: usize,
    /// At least one, times ascending. Before the first and after the last one the instance stands still.
    pub keys: Vec<Pose>,
}

/// Where an instance is at a time, relative to its own transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The time of the pose.
    pub time: f64,
    /// The displacement in world space, which is linear between keys.
    pub translation: DVec3,
    /// The rotation about the origin of the instance's mesh, along the world's axes, as a unit quaternion. Between keys it turns at constant
    /// speed, the shorter way.
    pub rotation: DQuat,
}

/// A time in which an emitter does not shine.
#[derive(Clone, Debug, PartialEq)]
pub struct Blackout {
    /// The emitter that does not shine.
    pub emitter: Emitter,
    /// The time in which it is dark.
    pub time: Range<f64>,
}

/// What emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Emitter {
    /// All surfaces of a material, by its index.
    Material(usize),
    /// A light, by its index.
    Light(usize),
}

impl Animation {
    /// Whether nothing ever changes.
    pub fn is_still(&self) -> bool {
        self.motions.is_empty() && self.blackouts.is_empty() && self.rig.tracks.is_empty()
    }

    /// The time of a frame.
    fn time(&self, frame: f64) -> f64 {
        let time = self.start + frame / self.frame_rate;
        self.period.map_or(time, |period| time.rem_euclid(period))
    }

    /// What is wrong with it, as a sentence without a full stop.
    pub(crate) fn problem(&self, scene: &Scene) -> Option<String> {
        let motion = self.motions.iter().enumerate().find_map(|(index, motion)| {
            let first = self.motions[..index].iter().all(|other| other.instance != motion.instance);
            let ascending = motion.keys.windows(2).all(|pair| pair[0].time < pair[1].time);
            let sound = |key: &Pose| {
                key.time.is_finite() && key.translation.is_finite() && (key.rotation.length() - 1.0).abs() < 1.0e-6
            };
            let problems = [
                (motion.instance >= scene.instances.len(), "is of an instance that does not exist"),
                (!first, "is the second one of its instance"),
                (motion.keys.is_empty() || !ascending, "has no keys with ascending times"),
                (
                    !motion.keys.iter().all(sound),
                    "has a key that is not finite, or whose rotation is no unit quaternion",
                ),
            ];
            let (_, problem) = problems.iter().find(|(is_wrong, _)| *is_wrong)?;
            Some(format!("motion {index} {problem}; correct it"))
        });
        let blackout = || {
            self.blackouts.iter().position(|blackout| match blackout.emitter {
                Emitter::Material(index) => index >= scene.materials.len(),
                Emitter::Light(index) => index >= scene.lights.len(),
            })
        };
        let positive = |number: f64| number.is_finite() && number > 0.0;
        let period = self.period.filter(|period| !positive(*period));
        let rate = Some(self.frame_rate).filter(|rate| !positive(*rate));
        let start = Some(self.start).filter(|start| !start.is_finite());
        self.rig
            .check(scene)
            .err()
            .or(motion)
            .or_else(|| blackout().map(|i| format!("blackout {i} is of an emitter that does not exist; correct it")))
            .or_else(|| period.map(|period| format!("the period of its animation is {period}; give a positive one")))
            .or_else(|| {
                rate.map(|rate| format!("its animation has {rate} frames in a unit of time; give a positive number"))
            })
            .or_else(|| start.map(|start| format!("its animation starts at {start}; give a finite time")))
    }
}

impl Motion {
    fn at(&self, time: f64) -> Option<Pose> {
        let next = self.keys.partition_point(|key| key.time <= time);
        let (Some(a), Some(b)) = (next.checked_sub(1).and_then(|i| self.keys.get(i)), self.keys.get(next)) else {
            return self.keys.get(next).or(self.keys.last()).copied();
        };
        let share = (time - a.time) / (b.time - a.time);
        Some(Pose {
            time,
            translation: a.translation.lerp(b.translation, share),
            rotation: a.rotation.slerp(b.rotation, share),
        })
    }
}

impl Scene {
    /// The scene as it stands at a frame, which may lie between two. It has no animation, and shares with this one what does
    /// not deform.
    #[must_use]
    pub fn at(&self, frame: f64) -> Scene {
        let mut scene = self.without_animation();
        let time = self.animation.time(frame);
        self.animation.rig.pose(&mut scene, time);
        for motion in &self.animation.motions {
            if let (Some(instance), Some(key)) = (scene.instances.get_mut(motion.instance), motion.at(time)) {
                let transform = &mut instance.transform;
                transform.matrix3 = DMat3::from_quat(key.rotation) * transform.matrix3;
                transform.translation += key.translation;
            }
        }
        for blackout in self.animation.blackouts.iter().filter(|blackout| blackout.time.contains(&time)) {
            match blackout.emitter {
                Emitter::Material(index) => scene.materials.get_mut(index).map(|m| m.emission = [0.0; 3]),
                Emitter::Light(index) => scene.lights.get_mut(index).map(|light| light.intensity = [0.0; 3]),
            };
        }
        scene
    }

    /// The camera as of [`Self::at`].
    pub fn camera_at(&self, frame: f64) -> Option<Camera> {
        Some(self.animation.rig.camera(self.camera?, self.animation.time(frame), self.origin))
    }

    fn without_animation(&self) -> Scene {
        let Scene { name, meshes, instances, materials, textures, lights, environment, .. } = self;
        Scene {
            name: name.clone(),
            meshes: meshes.clone(),
            instances: instances.clone(),
            materials: materials.clone(),
            textures: textures.clone(),
            lights: lights.clone(),
            environment: environment.clone(),
            camera: self.camera,
            animation: Animation::default(),
            origin: self.origin,
            default_size: self.default_size,
            files: self.files.clone(),
            warnings: self.warnings.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::scene::{Instance, Light, LightKind, Material};

    fn scene() -> Scene {
        let key = |time, x, turn| Pose { time, translation: DVec3::X * x, rotation: DQuat::from_rotation_z(turn) };
        let bulb = LightKind::Point { position: DVec3::ZERO };
        let rest = DAffine3::from_translation(DVec3::Y) * DAffine3::from_scale(DVec3::splat(2.0));
        Scene {
            instances: vec![Instance::new(0, rest)],
            materials: vec![Material::emitter("lamp", [0.0; 3], [1.0; 3])],
            lights: vec![Light { name: String::new(), intensity: [1.0; 3], kind: bulb }],
            animation: Animation {
                motions: vec![Motion { instance: 0, keys: vec![key(1.0, 0.0, 0.0), key(3.0, 4.0, 1.0)] }],
                blackouts: vec![
                    Blackout { emitter: Emitter::Material(0), time: 2.0..3.0 },
                    Blackout { emitter: Emitter::Light(0), time: 4.0..5.0 },
                ],
                period: Some(10.0),
                ..Animation::default()
            },
            ..Scene::default()
        }
    }

    #[test]
    fn motions_interpolate_their_keys_about_the_origin_of_the_mesh() {
        let scene = scene();
        for (time, x, turn) in [(0.0, 0.0, 0.0), (2.0, 2.0, 0.5), (3.0, 4.0, 1.0), (9.0, 4.0, 1.0), (12.0, 2.0, 0.5)] {
            let moved = scene.at(time);
            assert!(moved.animation.is_still());
            let [origin, tip] = [DVec3::ZERO, DVec3::X].map(|p| moved.instances[0].transform.transform_point3(p));
            let expected = DVec3::new(x, 1.0, 0.0);
            assert!((origin - expected).length() < 1.0e-12, "{time}: {origin}");
            assert!((tip - origin - DQuat::from_rotation_z(turn) * DVec3::X * 2.0).length() < 1.0e-12, "{time}: {tip}");
        }
    }

    #[test]
    fn emitters_go_out_and_come_back() {
        let shining = |time: f64| {
            let moved = scene().at(time);
            (moved.materials[0].emission[0] > 0.0, moved.lights[0].intensity[0] > 0.0)
        };
        assert_eq!(shining(1.0), (true, true));
        assert_eq!(shining(2.0), (false, true));
        assert_eq!(shining(3.0), (true, true));
        assert_eq!(shining(14.5), (true, false));
    }

    #[test]
    fn what_cannot_be_is_named() {
        let problem = |edit: fn(&mut Animation)| {
            let mut scene = scene();
            edit(&mut scene.animation);
            scene.animation.problem(&scene)
        };
        assert_eq!(problem(|_| ()), None);
        type Edit = fn(&mut Animation);
        let wrong: [(Edit, &str); 6] = [
            (|a| a.motions[0].instance = 1, "does not exist"),
            (|a| a.motions.push(a.motions[0].clone()), "second"),
            (|a| a.motions[0].keys.reverse(), "ascending"),
            (|a| a.motions[0].keys[0].translation.x = f64::NAN, "finite"),
            (|a| a.blackouts[1].emitter = Emitter::Light(1), "blackout 1"),
            (|a| a.period = Some(0.0), "period"),
        ];
        for (edit, part) in wrong {
            assert!(problem(edit).expect(part).contains(part));
        }
    }
}
