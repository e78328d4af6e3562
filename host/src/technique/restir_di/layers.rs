//! What reservoirs hold, pixel by pixel, to be looked at.

use super::lineage::{Follower, Origin, ReservoirPass};
use crate::exec::{Executor, Observer};
use crate::render::{self, Render, Rendered};
use crate::{Error, buffers::SceneBuffers, image::Channel, memory};
use rayon::prelude::*;
use restir_shared::{technique::restir_di::Stored, vec::luminance};
use std::collections::BTreeMap;

/// The reservoirs of the last frame.
pub struct Layers {
    /// The reservoirs, rows from top to bottom.
    pub reservoirs: Vec<Stored>,
    /// For how many frames each of them has had its sample, which is drawn in the frame of age 0; without a sample, for how
    /// many it has had none.
    pub ages: Vec<u32>,
}

impl Layers {
    /// As channels of an EXR file, named after the layer `reservoir`: confidence `M`, contribution weight `W`, the luminance of its `visibility`,
    /// index of the `light` and `age` in frames; these two are -1 without a sample.
    pub fn channels(&self) -> Vec<Channel> {
        let channel = |name, value: &dyn Fn(&Stored, u32) -> f32| Channel {
            name,
            values: self.reservoirs.iter().zip(&self.ages).map(|(stored, &age)| value(stored, age)).collect(),
        };
        let with_sample = |stored: &Stored, value: u32| if stored.sample.is_light() { value as f32 } else { -1.0 };
        vec![
            channel("reservoir.M", &|stored, _| stored.confidence),
            channel("reservoir.W", &|stored, _| stored.contribution_weight),
            channel("reservoir.visibility", &|stored, _| luminance(stored.visibility)),
            channel("reservoir.light", &|stored, _| with_sample(stored, stored.sample.light)),
            channel("reservoir.age", &with_sample),
        ]
    }
}

/// As [`render::render`], with the reservoirs of the last frame. The plan is the same; ages are found by replaying natively all
/// passes that combine reservoirs, which takes the time that they take on the CPU.
///
/// # Errors
/// As of [`render::render`].
pub fn render_with_layers(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<(Rendered, Layers), Error> {
    render::check(scene, render)?;
    // beside the plan: its planes read back, ages, channels and their encoded form
    let bytes = 2 * render.plan(scene).bytes() + 64 * u64::from(render.width) * u64::from(render.height);
    memory::check(bytes, "this render with layers", "choose a smaller size")?;
    let mut follower = Follower::new(scene, render);
    let mut ages = BTreeMap::new();
    let mut last = None;
    let rendered = render::render(executor, scene, render, &mut |step| {
        if let Some(pass) = follower.follow(step)? {
            ages.insert(pass.made.made_by, ages_after(&pass, &ages));
            ages.retain(|&pass, _| follower.kept().any(|kept| kept == pass));
            last = Some(pass.made);
        }
        observe(step)
    })?;
    let (reservoirs, ages) = last.map_or_else(Default::default, |made| {
        let reservoirs = made.words.iter().map(|&word| Stored::unpack(word)).collect();
        (reservoirs, ages.remove(&made.made_by).unwrap_or_default())
    });
    Ok((rendered, Layers { reservoirs, ages }))
}

/// The ages of a pass's samples, by those of the passes before.
fn ages_after(pass: &ReservoirPass, before: &BTreeMap<usize, Vec<u32>>) -> Vec<u32> {
    let age = |pixel: usize| match pass.replay(pixel as u32).1 {
        Origin::Candidate(_) => 0,
        Origin::Reservoir { made_by, pixel, of_last_frame, .. } => {
            before[&made_by][pixel as usize] + u32::from(of_last_frame)
        }
    };
    if pass.is_initial() {
        return vec![0; pass.made.words.len()];
    }
    (0..pass.made.words.len()).into_par_iter().map(age).collect()
}
