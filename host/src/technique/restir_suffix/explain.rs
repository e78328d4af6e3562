//! What is printed of a pixel: its supporting prefix, and whose suffixes its integration prefixes borrow.

use crate::exec::{CpuExecutor, Executor, Step};
use crate::render::Render;
use crate::technique::explain::{Explanation, Subject, vector, verdict};
use crate::{Error, buffers::SceneBuffers};
use restir_kernels::restir_suffix as suffix;
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::resample::mutual::{ShiftRequest, ShiftResult};
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::PackedPath;
use restir_shared::technique::restir_suffix::{Lent, Nearest, SuffixParams, Throughput};
use serde_json::{Value, json};
use std::fmt::Write;

/// A pixel of the last frame.
#[derive(Clone, Debug, Default, PartialEq)]
struct Pixel {
    supporting: Option<PathOrigin>,
    /// The pixel that had this prefix in the last frame.
    kept_of: Option<u32>,
    integration: Vec<Integration>,
    /// By another technique.
    direct: Vec3,
    /// Of the whole frame.
    radiance: [f32; 3],
}

/// An integration prefix, and what it adds to the picture.
#[derive(Clone, Debug, PartialEq)]
struct Integration {
    end: PathOrigin,
    throughput: Vec3,
    /// Light that it finds on its way.
    light: Vec3,
    lenders: Vec<Lender>,
    /// By its own suffix, if it has one.
    canonical: Option<Vec3>,
}

/// Who lends a suffix, and what arrives of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lender {
    pixel: u32,
    confidence: f32,
    light: Vec3,
}

/// Explains a pixel of the last frame.
pub(super) fn explain(executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
    let Subject { scene, buffers, render, place } = subject;
    place.check(render)?;
    let index = (place.y * render.width + place.x) as usize;
    let pixel = followed(executor, buffers, render, index)?;
    let same = pixel == followed(&mut CpuExecutor::with_threads(1)?, buffers, render, index)?;
    let Render { width, height, count, seed, technique, .. } = render;
    let name = technique.about().name;
    let text = format!(
        "{}, {width} x {height} pixels, {name}: {count} frames, seed {seed}, pixel ({}, {})\n{}replayed natively: {}\n",
        scene.name,
        place.x,
        place.y,
        pixel.text(*width),
        verdict(same)
    );
    let json = json!({
        "scene": scene.name,
        "technique": name,
        "width": width,
        "height": height,
        "frames": count,
        "seed": seed,
        "pixel": [place.x, place.y],
        "supporting": pixel.supporting.map(|end| prefix_json(&end)),
        "kept_of": pixel.kept_of.map(|of| position(of, *width)),
        "prefixes": pixel.integration.iter().map(|prefix| prefix.json(*width)).collect::<Vec<_>>(),
        "direct": pixel.direct.to_array(),
        "radiance": pixel.radiance,
        "identical": same,
    });
    Ok(Explanation { text, json })
}

/// Renders, and keeps what is said of a pixel in the last frame.
fn followed(executor: &mut dyn Executor, scene: &SceneBuffers, render: &Render, index: usize) -> Result<Pixel, Error> {
    let (mut pixel, mut film) = (Pixel::default(), Vec3::ZERO);
    let render = Render { accumulate: false, ..render.clone() };
    let rendered = render.render_observed(scene, executor, &mut |step| {
        let params: Option<SuffixParams> = step.pass.params();
        match params {
            Some(params) if params.frame + 1 == render.count => pixel.follow(step, &params, index, &mut film),
            _ => Ok(()),
        }
    })?;
    pixel.radiance = rendered.image.pixels[index];
    pixel.direct = Vec3::from_array(pixel.radiance) - film;
    Ok(pixel)
}

impl Pixel {
    /// Takes what a pass has made; `film` is the pixel's radiance before.
    fn follow(&mut self, step: &Step<'_>, params: &SuffixParams, index: usize, film: &mut Vec3) -> Result<(), Error> {
        let name = step.pass.kernel.name;
        if name == suffix::suffix_support::DESC.name {
            self.supporting = Some(step.plane::<PathOrigin>("origins")?[index]);
        } else if name == suffix::suffix_keep::DESC.name {
            self.supporting = Some(step.plane::<PathOrigin>("origins")?[index]);
            let request = step.plane::<ShiftRequest>("requests")?[index];
            self.kept_of = request.exists().then_some(request.sample);
        } else if name == suffix::suffix_prefix::DESC.name {
            let throughput = Vec3::from_array(step.plane::<Throughput>("throughputs")?[index].throughput);
            let end = step.plane::<PathOrigin>("ends")?[index];
            let light = added(step, index, film)?;
            self.integration.push(Integration { end, throughput, light, lenders: Vec::new(), canonical: None });
        } else if let Some(prefix) = self.integration.last_mut() {
            if name == suffix::suffix_gather::DESC.name {
                prefix.lenders = lenders(step, params, index, prefix.throughput)?;
                added(step, index, film)?;
            } else if name == suffix::suffix_canonical::DESC.name {
                prefix.canonical = Some(added(step, index, film)?);
            }
        }
        Ok(())
    }

    fn text(&self, width: u32) -> String {
        let supporting = self.supporting.as_ref().map_or_else(|| "none".to_owned(), described);
        let from = match self.kept_of {
            Some(of) => format!("kept: the pixel {} had it in the last frame", place(of, width)),
            None => "new".to_owned(),
        };
        let mut text = format!("its supporting prefix: {supporting}; {from}\n");
        for (index, prefix) in self.integration.iter().enumerate() {
            let _ = write!(text, "integration prefix {index}: {}", prefix.text(width));
        }
        if self.direct != Vec3::ZERO {
            let _ = writeln!(text, "direct light, by another technique: {}", vector(self.direct));
        }
        let _ = writeln!(text, "in all {}", vector(Vec3::from_array(self.radiance)));
        text
    }
}

impl Integration {
    fn text(&self, width: u32) -> String {
        let Self { end, throughput, light, lenders, canonical } = self;
        let worth = if end.segments() == 0 { String::new() } else { format!(", worth {}", vector(*throughput)) };
        let mut text = format!("{}{worth}; light on its way {}\n", described(end), vector(*light));
        for Lender { pixel, confidence, light } in lenders {
            let _ = writeln!(
                text,
                "   the suffix of {}, confidence {confidence}, sends {}",
                place(*pixel, width),
                vector(*light)
            );
        }
        if let Some(light) = canonical {
            let _ = writeln!(text, "   its own suffix sends {}", vector(*light));
        }
        text
    }

    fn json(&self, width: u32) -> Value {
        let lender = |Lender { pixel, confidence, light }: &Lender| json!({"pixel": position(*pixel, width), "confidence": confidence, "light": light.to_array()});
        json!({
            "end": prefix_json(&self.end),
            "throughput": self.throughput.to_array(),
            "light": self.light.to_array(),
            "borrowed": self.lenders.iter().map(lender).collect::<Vec<_>>(),
            "canonical": self.canonical.map(|light| light.to_array()),
        })
    }
}

/// Who lends to a pixel, and what each sends to the picture, by the pass that gathers it.
fn lenders(step: &Step<'_>, params: &SuffixParams, index: usize, throughput: Vec3) -> Result<Vec<Lender>, Error> {
    let (records, nearest) = (step.plane::<PackedPath>("reservoirs")?, step.plane::<Nearest>("nearest")?);
    let results = step.plane::<ShiftResult>("results")?;
    let crossed = step.plane::<ShiftResult>("crossed")?;
    let lent = Lent { records: &records, nearest: &nearest, results: &results };
    let found = (0..params.borrowed).zip(nearest[index].pixels).filter(|(_, pixel)| *pixel != u32::MAX);
    let lender = |(n, pixel): (u32, u32)| {
        let confidence = lent.confidence(params, index as u32, n);
        let sent = lent.by(params, &crossed, index as u32, n) / params.prefixes as f32;
        Lender { pixel, confidence, light: throughput * sent }
    };
    Ok(found.map(lender).collect())
}

/// What a pass has added to the pixel, which had `film` before.
fn added(step: &Step<'_>, index: usize, film: &mut Vec3) -> Result<Vec3, Error> {
    let after = Vec3::from_array(step.plane::<FilmPixel>("film")?[index].sum);
    let before = std::mem::replace(film, after);
    Ok(after - before)
}

/// Where a prefix ends.
fn described(end: &PathOrigin) -> String {
    match end.segments() {
        0 => "without an end".to_owned(),
        segments => format!("{segments} segments, {:.4} long", end.reach()),
    }
}

fn prefix_json(end: &PathOrigin) -> Value {
    json!({"segments": end.segments(), "length": end.reach()})
}

fn position(pixel: u32, width: u32) -> [u32; 2] {
    [pixel % width, pixel / width]
}

fn place(pixel: u32, width: u32) -> String {
    let [x, y] = position(pixel, width);
    format!("({x}, {y})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::settings::Value as _;
    use crate::technique::Direct;
    use crate::technique::restir_suffix::SuffixSettings;

    /// What is said to arrive adds up to the pixel, and some of it is borrowed, whoever finds direct light.
    #[test]
    fn parts_add_up_to_the_pixel() {
        let scene = SceneBuffers::build(&Scene::load("cornell").expect("built in")).expect("builds");
        for direct in ["unified", "restir-di"] {
            let direct = Direct::read(direct).expect("known");
            let settings = SuffixSettings { max_depth: 5, borrowed: 3, direct, ..SuffixSettings::default() };
            let render = Render { count: 3, ..Render::new([16, 12], settings) };
            let [mut borrowed, mut by_other] = [Vec3::ZERO; 2];
            for index in [20, 90, 100, 170] {
                let pixel = followed(&mut CpuExecutor::inline(), &scene, &render, index).expect("explains");
                let of_prefix = |prefix: &Integration| {
                    let lent: Vec3 = prefix.lenders.iter().map(|lender| lender.light).sum();
                    (lent, prefix.light + lent + prefix.canonical.unwrap_or_default())
                };
                let parts: Vec<(Vec3, Vec3)> = pixel.integration.iter().map(of_prefix).collect();
                let sum = pixel.direct + parts.iter().map(|(_, all)| *all).sum::<Vec3>();
                borrowed += parts.iter().map(|(lent, _)| *lent).sum::<Vec3>();
                let off = (sum - Vec3::from_array(pixel.radiance)).abs().max_element();
                assert!(parts.len() == 4 && off < 1.0e-5 * sum.max_element(), "pixel {index}: {pixel:?}");
                by_other += pixel.direct;
            }
            assert!(borrowed.min_element() > 0.0, "nothing is borrowed");
            assert_eq!(by_other == Vec3::ZERO, direct.is_unified(), "{by_other} by another technique");
        }
    }
}
