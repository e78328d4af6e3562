//! Layers of an image by how often light was scattered inside of things, or by the parts of a render with profiles.

use std::ops::RangeInclusive;

use super::{Orders, Parts, PathSettings, Subsurface};
use crate::exec::{Executor, Observer};
use crate::image::Channel;
use crate::render::Render;
use crate::technique::Technique;
use crate::technique::inspect::Layered;
use crate::{Error, buffers::SceneBuffers};

/// Collisions, and the names of the channels of light that had so many: 0, 1, 2, up to 4, 8 and 16, and more (the steps of Zhang and
/// d'Eon 2025).
const LAYERS: [(RangeInclusive<u32>, [&str; 3]); 7] = [
    (0..=0, ["order.0.R", "order.0.G", "order.0.B"]),
    (1..=1, ["order.1.R", "order.1.G", "order.1.B"]),
    (2..=2, ["order.2.R", "order.2.G", "order.2.B"]),
    (3..=4, ["order.3-4.R", "order.3-4.G", "order.3-4.B"]),
    (5..=8, ["order.5-8.R", "order.5-8.G", "order.5-8.B"]),
    (9..=16, ["order.9-16.R", "order.9-16.G", "order.9-16.B"]),
    (17..=u32::MAX, ["order.17.R", "order.17.G", "order.17.B"]),
];

/// What enters no body by the first surface's lobes, and the parts of what does, where profiles are.
const PARTS: [(Parts, [&str; 3]); 5] = [
    (Parts::Diffuse, ["part.diffuse.R", "part.diffuse.G", "part.diffuse.B"]),
    (Parts::Specular, ["part.specular.R", "part.specular.G", "part.specular.B"]),
    (Parts::Boundary, ["part.boundary.R", "part.boundary.G", "part.boundary.B"]),
    (Parts::Single, ["part.single.R", "part.single.G", "part.single.B"]),
    (Parts::Profile, ["part.profile.R", "part.profile.G", "part.profile.B"]),
];

/// As [`Render::render`], with channels for light by how often it was scattered inside of things, or by the part that holds it where profiles
/// are. Each is a render of its own with the same random numbers, so that the image is their sum, but for roundings, and all take as long as so
/// many images.
pub(super) fn render_with_layers(
    settings: &PathSettings,
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<Layered<Vec<Channel>>, Error> {
    let layers = match settings.subsurface(scene.features) {
        Subsurface::Off => {
            let reason = "nothing scatters light inside of things, and layers are by how often it was scattered";
            return Err(Error::NoLayers { technique: settings.about().name, reason });
        }
        Subsurface::Walk => LAYERS.map(|(range, names)| (names, of_orders(settings, &range))).to_vec(),
        Subsurface::Diffusion | Subsurface::Hybrid => {
            PARTS.map(|(part, names)| (names, of_part(settings, part))).to_vec()
        }
    };
    let rendered = render.render_observed(scene, executor, observe)?;
    let mut channels = Vec::new();
    for (names, settings) in layers {
        let values = if let Some(settings) = settings {
            let part = Render { technique: settings.into(), ..render.clone() };
            part.render_observed(scene, executor, observe)?.image.pixels
        } else {
            vec![[0.0; 3]; rendered.image.pixels.len()]
        };
        let of = |(channel, name)| Channel { name, values: values.iter().map(|pixel| pixel[channel]).collect() };
        channels.extend(names.into_iter().enumerate().map(of));
    }
    Ok(Layered { rendered, layers: channels })
}

/// Of what the image shows, the light that collided so often.
fn of_orders(settings: &PathSettings, range: &RangeInclusive<u32>) -> Option<PathSettings> {
    let least = settings.orders.least.max(*range.start());
    let most = settings.orders.most.min(*range.end());
    (least <= most).then(|| PathSettings { orders: Orders { least, most }, ..settings.clone() })
}

/// Of what the image shows, a part.
fn of_part(settings: &PathSettings, part: Parts) -> Option<PathSettings> {
    settings.parts.has(part).then(|| PathSettings { parts: part, ..settings.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::CpuExecutor;
    use crate::scene::builtin;
    use crate::technique::inspect::Inspect;

    #[test]
    fn layers_sum_up_to_the_image_and_need_a_medium() {
        let layers = |name: &str, settings: PathSettings| {
            let scene = SceneBuffers::build(&builtin::scene(name).expect("built in")).expect("builds");
            let render = Render { count: 4, ..Render::new([24, 18], settings.clone()) };
            settings.render_with_layers(&mut CpuExecutor::inline(), &scene, &render, &mut |_| Ok(()))
        };
        let walk = |orders| PathSettings { orders, ..PathSettings::default() };
        let profile = |subsurface, parts| PathSettings { subsurface, parts, ..PathSettings::default() };
        for (name, settings, count, least) in [
            ("slab", walk(Orders::ALL), 21, 9),
            ("slab", walk(Orders { least: 1, most: 3 }), 21, 9),
            ("slab", profile(Subsurface::Hybrid, Parts::All), 15, 9),
            ("slab", profile(Subsurface::Hybrid, Parts::Subsurface), 15, 9),
            ("slab", profile(Subsurface::Diffusion, Parts::All), 15, 3),
            ("candles", profile(Subsurface::Hybrid, Parts::All), 15, 15),
            ("candles", profile(Subsurface::Hybrid, Parts::Rest), 15, 6),
        ] {
            let Layered { rendered, layers: channels } = layers(name, settings).expect("renders");
            assert_eq!(channels.len(), count);
            let lit = channels.iter().filter(|channel| channel.values.iter().any(|&x| x > 0.0));
            assert!(lit.count() >= least, "{name}");
            for (i, pixel) in rendered.image.pixels.iter().enumerate() {
                let sum: f32 = channels.iter().skip(1).step_by(3).map(|channel| channel.values[i]).sum();
                assert!((sum - pixel[1]).abs() <= 1.0e-5 * pixel[1], "{name}: {sum} {pixel:?}");
            }
        }
        assert!(matches!(layers("cornell", walk(Orders::ALL)), Err(crate::Error::NoLayers { technique: "path", .. })));
    }
}
