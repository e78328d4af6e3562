//! What a reservoir is to those who ask where it comes from: how its passes are replayed, what is printed of it, and its layers.

use crate::technique::explain::light_kind;
use crate::technique::reuse::explain::Genealogy;
use crate::technique::reuse::{Followed, Generation, Kernel, Layers, Lineage, Origin, Replay, Reuse, Reused, ages};
use crate::{Error, buffers::SceneBuffers, image::Channel};
use restir_kernels::restir_di::{di_combine, di_initial, di_primary, di_tiles};
use restir_shared::layout::TRIANGLE_WORDS;
use restir_shared::scene::{AddressedLights, Frames, LightAddress, LightKind};
use restir_shared::technique::restir_di::{
    self as di, DiParams, FROM_SCATTERING, Flags, PackedHit, PackedReservoir, Stored, TileWords,
};
use restir_shared::vec::luminance;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// What a genealogy tells of a reservoir's sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleDetails {
    /// Its target at the pixel, without visibility.
    pub target: f32,
    /// Its light, if it has one.
    pub light: Option<LightSource>,
}

/// What a light is, in whatever frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSource {
    /// What emits.
    pub kind: LightKind,
    /// The triangle, in the order of the geometry arena, or the index among the scene's punctual lights.
    pub index: u32,
    /// The index of the material of a triangle; `None` of other lights.
    pub material: Option<u32>,
}

impl LightSource {
    fn of(scene: &SceneBuffers, address: LightAddress) -> Self {
        let view = scene.view();
        let kind = view.light_at(address).sample.kind;
        let index = scene.light_index(address.light);
        let first_word = (view.header.triangle_base + index * TRIANGLE_WORDS) as usize;
        let material = (kind == LightKind::Area).then(|| view.geometry[first_word].w);
        Self { kind, index, material }
    }

    fn material_name<'a>(&self, genealogy: &Genealogy<'a, PackedReservoir>) -> Option<&'a str> {
        genealogy.scene.materials.get(self.material? as usize).map(|material| material.name.as_str())
    }
}

impl Reused for PackedReservoir {
    type Params = DiParams;
    type Stored = Stored;
    type Details = SampleDetails;
    /// For how many frames a pixel has had its sample.
    type Beside = u32;

    const KERNELS: &'static [Kernel] = &[
        Kernel { desc: &di_initial::DESC, records: Some("reservoirs"), others: &[] },
        Kernel { desc: &di_tiles::DESC, records: None, others: &["tiles"] },
        Kernel { desc: &di_primary::DESC, records: None, others: &["hits"] },
        Kernel { desc: &di_combine::DESC, records: Some("reservoirs"), others: &[] },
    ];
    const OTHER: [&'static str; 2] = ["the neighbour", "pixel"];
    const RECORDS: &'static str = "reservoirs";

    fn stored(&self) -> Stored {
        Stored::unpack(*self)
    }

    fn has_sample(&self) -> bool {
        self.stored().sample.is_light()
    }

    fn confidence(&self) -> f32 {
        self.stored().confidence
    }

    fn reuse(pass: &Followed<Self>) -> Reuse {
        let p = &pass.params;
        match (pass.is_initial(), pass.crosses(), p.neighbours) {
            (true, ..) => Reuse::Initial,
            (_, true, 0) => Reuse::Temporal,
            (_, true, _) => Reuse::Fused,
            _ => Reuse::Spatial(p.merge),
        }
    }

    fn replay(pass: &Followed<Self>) -> Result<Replay<'_, Self>, Error> {
        let (p, frames, hits) = (&pass.params, &*pass.frames, pass.read::<PackedHit>("hits")?);
        if pass.is_initial() {
            let tiles = pass.read_if::<TileWords>(p.flags.contains(Flags::TILES), "tiles")?;
            return Ok(Box::new(move |pixel| {
                let (hit, at) = (hits[pixel as usize], pass.position(pixel));
                let di::Initial { reservoir, candidate, .. } = di::initial(&frames.scene(false), p, tiles, hit, at);
                (reservoir, Origin::Candidate(candidate))
            }));
        }
        let crosses = pass.crosses();
        let planes = di::Planes { hits, other_hits: pass.read("other_hits")?, others: pass.read("others")? };
        // the pixel's own is in another plane than its neighbours', if those are of the last frame
        let role_of_own = if crosses { "reservoirs" } else { "others" };
        let (own, makers) = (pass.read(role_of_own)?, [pass.maker(role_of_own)?, pass.maker("others")?]);
        Ok(Box::new(move |pixel| {
            let di::Combined { reservoir, source } =
                di::combine(frames, p, &planes, own[pixel as usize], pass.position(pixel));
            let di::Source { is_other, pixel } = source;
            let made_by = makers[usize::from(is_other)];
            (reservoir, Origin::Record { made_by, pixel, is_other, of_last_frame: is_other && crosses })
        }))
    }

    fn details(lineage: &Lineage<Self>, pass: usize, pixel: u32) -> Result<SampleDetails, Error> {
        let pass = lineage.pass(pass)?;
        let (hits, address) = (pass.read::<PackedHit>("hits")?, pass.records()[pixel as usize].stored().sample);
        let (scene, at) = ((&*pass.frames).scene(false), pass.position(pixel));
        let target = di::target(&scene, &pass.params, hits[pixel as usize], at, address);
        let light = address.is_light().then(|| LightSource::of(pass.frames.this(), address));
        Ok(SampleDetails { target, light })
    }

    fn drawn(candidate: u32) -> String {
        match candidate {
            FROM_SCATTERING => "drawn as the candidate from scattering".to_owned(),
            index => format!("drawn as candidate {index} of those from lights"),
        }
    }

    fn words(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> String {
        let Stored { sample: address, contribution_weight, visibility, .. } = g.stored();
        let SampleDetails { target, light } = g.details;
        let light = light.map_or("it has no sample".to_owned(), |light| {
            let what = match light.material_name(genealogy) {
                Some(material) => format!("triangle {}, {material}", light.index),
                None => light_kind(light.kind).to_owned(),
            };
            let ([u, v], origin) = ([address.u, address.v].map(unit), genealogy.origin(g.origin));
            format!("light {} ({what}) at u {u:.7}, v {v:.7}: {origin}", address.light)
        });
        format!("W {contribution_weight:e}, visibility {visibility}, target {target:e}\n   {light}\n")
    }

    fn fields(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> Value {
        let Stored { sample: address, contribution_weight, visibility, .. } = g.stored();
        let SampleDetails { target, light } = g.details;
        json!({
            "contribution_weight": contribution_weight,
            "visibility": visibility.to_array(),
            "target": target,
            "light": light.map(|light| json!({
                "index": address.light,
                "kind": light_kind(light.kind),
                "triangle": light.material.map(|_| light.index),
                "material": light.material_name(genealogy),
                "u": unit(address.u),
                "v": unit(address.v),
            })),
            "from": light.map(|_| origin_fields(genealogy, g.origin)),
        })
    }

    fn beside(lineage: &Lineage<Self>, pass: usize, before: &BTreeMap<usize, Vec<u32>>) -> Result<Vec<u32>, Error> {
        ages(lineage.pass(pass)?, before)
    }

    /// Named after the layer `reservoir`: confidence `M`, contribution weight `W`, the luminance of its `visibility`, index of the `light` and
    /// `age` in frames; these two are -1 without a sample.
    fn channels(layers: &Layers<Self>) -> Vec<Channel> {
        let of_sample = |stored: &Stored, value: u32| if stored.sample.is_light() { value as f32 } else { -1.0 };
        let ages = layers.records.iter().zip(&layers.beside).map(|(stored, &age)| of_sample(stored, age)).collect();
        vec![
            layers.channel("reservoir.M", |stored| stored.confidence),
            layers.channel("reservoir.W", |stored| stored.contribution_weight),
            layers.channel("reservoir.visibility", |stored| luminance(stored.visibility)),
            layers.channel("reservoir.light", |stored| of_sample(stored, stored.sample.light)),
            Channel { name: "reservoir.age", values: ages },
        ]
    }
}

fn origin_fields(genealogy: &Genealogy<'_, PackedReservoir>, origin: Origin) -> Value {
    let of_record = |what, pixel| json!({"reservoir": what, "pixel": genealogy.position(pixel)});
    match origin {
        Origin::Candidate(FROM_SCATTERING) => json!({"candidate": null, "of": "scattering"}),
        Origin::Candidate(index) => json!({"candidate": index, "of": "lights"}),
        Origin::Record { is_other: false, pixel, .. } => of_record("own", pixel),
        Origin::Record { of_last_frame: true, pixel, .. } => of_record("last frame", pixel),
        Origin::Record { pixel, .. } => of_record("neighbour", pixel),
    }
}

/// A coordinate in 2^-24.
fn unit(lattice: u32) -> f64 {
    f64::from(lattice) / f64::from(1 << 24)
}
