//! Layers of an image by how often light was scattered inside of things.

use std::ops::RangeInclusive;

use super::{Orders, PathSettings, Subsurface};
use crate::exec::{Executor, Observer};
use crate::image::Channel;
use crate::render::{self, Render, Rendered};
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

/// As [`render::render`], with the parts of each range of orders as channels. Each is a render of its own with the same random numbers, so that
/// the image is their sum, but for roundings, and all take as long as so many images.
pub(super) fn render_with_layers(
    settings: &PathSettings,
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<(Rendered, Vec<Channel>), Error> {
    if settings.subsurface(scene.features) != Subsurface::Walk {
        let problem = "nothing scatters light inside of things here, so that there are no layers by how often it did; leave out --layers";
        return Err(Error::Setting(problem.to_owned()));
    }
    let rendered = render::render(executor, scene, render, observe)?;
    let mut channels = Vec::new();
    for (range, names) in LAYERS {
        let orders =
            Orders { least: settings.orders.least.max(*range.start()), most: settings.orders.most.min(*range.end()) };
        let values = if orders.least <= orders.most {
            let part = Render { technique: PathSettings { orders, ..settings.clone() }.into(), ..render.clone() };
            render::render(executor, scene, &part, observe)?.image.pixels
        } else {
            vec![[0.0; 3]; rendered.image.pixels.len()]
        };
        channels.extend(
            names
                .into_iter()
                .enumerate()
                .map(|(channel, name)| Channel { name, values: values.iter().map(|pixel| pixel[channel]).collect() }),
        );
    }
    Ok((rendered, channels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::CpuExecutor;
    use crate::scene::builtin;
    use crate::technique::Technique;

    #[test]
    fn layers_sum_up_to_the_image_and_need_a_medium() {
        let layers = |name: &str, orders| {
            let scene = SceneBuffers::build(&builtin::scene(name).expect("built in")).expect("builds");
            let settings = PathSettings { orders, ..PathSettings::default() };
            let render = Render { count: 2, ..Render::new([12, 10], settings.clone()) };
            settings.render_with_layers(&mut CpuExecutor::inline(), &scene, &render, &mut |_| Ok(()))
        };
        for orders in [Orders::ALL, Orders { least: 1, most: 3 }] {
            let (rendered, channels) = layers("slab", orders).expect("renders");
            assert_eq!(channels.len(), 21);
            let lit = channels.iter().filter(|channel| channel.values.iter().any(|&x| x > 0.0));
            assert!(lit.count() >= 9);
            for (i, pixel) in rendered.image.pixels.iter().enumerate() {
                let sum: f32 = channels.iter().skip(1).step_by(3).map(|channel| channel.values[i]).sum();
                assert!((sum - pixel[1]).abs() <= 1.0e-5 * pixel[1], "{sum} {pixel:?}");
            }
        }
        assert!(layers("cornell", Orders::ALL).unwrap_err().to_string().contains("--layers"));
    }
}
