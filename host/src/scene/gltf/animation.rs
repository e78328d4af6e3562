//! Animations: the tracks of nodes.

use std::collections::BTreeSet;

use gltf::json::animation::{self, Animation, Channel, Interpolation as JsonInterpolation, Property as JsonProperty};
use gltf::json::validation::Checked;

use super::{Importer, Problem, exact, label};
use crate::scene::{Interpolation, Property, Track};

/// Frames in a second, the unit of time of a file, unless its extras say otherwise.
const FRAME_RATE: f64 = 24.0;

impl Importer<'_> {
    /// Reads all animations but those that move what one before them does: files have several ways to move the same body, of
    /// which the first is shown. The tracks have the nodes' indices in the file.
    pub(super) fn add_animations(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        let mut taken = BTreeSet::new();
        for (index, animation) in root.animations.iter().enumerate() {
            let name = label(animation.name.as_ref(), "animation", index);
            let tracks = self.about(format!("animation {name}"), |importer| importer.tracks(animation))?;
            let own: BTreeSet<_> = tracks.iter().map(|track| (track.node, track.property)).collect();
            if own.is_disjoint(&taken) {
                self.tracks.extend(tracks);
                taken.extend(own);
            } else {
                self.warn(format!("animation {name} moves what an animation before it moves and was ignored"));
            }
        }
        if !self.tracks.is_empty() {
            let extras = root.scenes.get(root.scene.map_or(0, |scene| scene.value())).map(|scene| &scene.extras);
            let times =
                extras.and_then(exact::times).unwrap_or(exact::Times { frame_rate: FRAME_RATE, ..Default::default() });
            let animation = &mut self.scene.animation;
            (animation.frame_rate, animation.start, animation.period) = (times.frame_rate, times.start, times.period);
        }
        Ok(())
    }

    fn tracks(&mut self, animation: &Animation) -> Result<Vec<Track>, Problem> {
        let mut tracks = Vec::new();
        for (number, channel) in animation.channels.iter().enumerate() {
            let Checked::Valid(path) = channel.target.path else {
                self.warn(format!("channel {number} moves something else than a node or weights and was ignored"));
                continue;
            };
            let track = self.track(animation, channel, path);
            tracks.push(track.map_err(|problem| format!("channel {number}: {problem}"))?);
        }
        Ok(tracks)
    }

    fn track(&self, animation: &Animation, channel: &Channel, path: JsonProperty) -> Result<Track, Problem> {
        let index = channel.sampler.value();
        let missing = || format!("it has sampler {index}, which does not exist");
        let sampler: &animation::Sampler = animation.samplers.get(index).ok_or_else(missing)?;
        let node = channel.target.node;
        self.document.get(node, "it moves node")?;
        let interpolation = match sampler.interpolation {
            Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
            Checked::Valid(JsonInterpolation::Linear) => Interpolation::Linear,
            Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::CubicSpline,
            Checked::Invalid => return Err("it has an unknown interpolation".to_owned()),
        };
        let (property, values) = match path {
            JsonProperty::Translation => {
                (Property::Translation, self.document.vectors::<3>(sampler.output)?.into_flattened())
            }
            JsonProperty::Rotation => {
                (Property::Rotation, self.document.vectors::<4>(sampler.output)?.into_flattened())
            }
            JsonProperty::Scale => (Property::Scale, self.document.vectors::<3>(sampler.output)?.into_flattened()),
            JsonProperty::MorphTargetWeights => {
                (Property::Weights, self.document.vectors::<1>(sampler.output)?.into_flattened())
            }
        };
        let times = self.document.vectors::<1>(sampler.input)?.into_flattened();
        Ok(Track { node: node.value(), property, interpolation, times, values })
    }
}
