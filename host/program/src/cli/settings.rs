//! Settings of a technique as `key=value`, and `restir settings`.

use std::fmt::Write;

use restir::Error;
use restir::di::{DiSettings, MisForm, Target, Visibility};
use restir::render::RenderSettings;

use super::console;
use super::render::Technique;

/// A setting: how it is called, what its values are, how it is read and set. Setting returns `None` if the text is no
/// value.
struct Key<S> {
    name: &'static str,
    values: &'static str,
    get: fn(&S) -> String,
    set: fn(&mut S, &str) -> Option<()>,
}

/// The keys of the technique `path`.
const PATH_KEYS: &[Key<RenderSettings>] = &[
    Key {
        name: "roulette",
        values: "on or off",
        get: |s| on_or_off(s.path.roulette),
        set: |s, value| on_off(&mut s.path.roulette, value),
    },
    Key {
        name: "jitter",
        values: "on or off",
        get: |s| on_or_off(s.path.jitter),
        set: |s, value| on_off(&mut s.path.jitter, value),
    },
    Key {
        name: "max_depth",
        values: "a number of segments",
        get: |s| s.path.max_depth.to_string(),
        set: |s, value| number(&mut s.path.max_depth, value),
    },
    Key {
        name: "dispatch_samples",
        values: "a number of samples",
        get: |s| s.dispatch_samples.map_or_else(|| "auto".to_owned(), |n| n.to_string()),
        set: |s, value| {
            s.dispatch_samples = Some(value.parse().ok()?);
            Some(())
        },
    },
];

macro_rules! keys {
    ($($field:ident: $kind:ident, $values:expr;)*) => {
        &[$(Key {
            name: stringify!($field),
            values: $values,
            get: |s| keys!(@get $kind, s.$field),
            set: |s, value| keys!(@set $kind, s.$field, value),
        }),*]
    };
    (@get number, $value:expr) => { $value.to_string() };
    (@get switch, $value:expr) => { on_or_off($value) };
    (@get choice, $value:expr) => { $value.name().to_owned() };
    (@set number, $place:expr, $text:expr) => { number(&mut $place, $text) };
    (@set switch, $place:expr, $text:expr) => { on_off(&mut $place, $text) };
    (@set choice, $place:expr, $text:expr) => { choice(&mut $place, $text) };
}

/// The keys of the technique `restir-di`.
const DI_KEYS: &[Key<DiSettings>] = keys! {
    candidates: number, "a number of candidates from lights";
    initial_rays: number, "a number of groups of candidates from lights, of each of which one is tested by a ray";
    tiles: number, "a number of tiles of candidates that pixels share; 0 if each samples its own";
    tile_size: number, "a number of candidates in a tile";
    scatter: switch, "on or off: one more candidate, from scattering";
    mis: choice, "1/m, 1/z, contribution, talbot, pairwise, pairwise-defensive, pairwise-counted, pairwise-counted-defensive or constant";
    temporal: switch, "on or off: reuse of the last frame";
    still: switch, "on or off: where camera and scene stand still, frames are merged by confidence, and visibility is taken as known";
    spatial: number, "a number of passes of spatial reuse";
    neighbours: number, "a number of neighbours of a pass";
    fused: switch, "on or off: the last frame's neighbours, in one pass with the last frame's reservoir";
    feedback: switch, "on or off: the next frame reuses what spatial reuse has made";
    radius: number, "the largest distance of a neighbour, in pixels";
    confidence_cap: number, "the largest confidence of the last frame's reservoirs, in initial reservoirs";
    initial_visibility: switch, "on or off: occluded initial samples count for nothing";
    target: choice, "luminance, red, green or blue: what of its light a sample is selected by";
    target_visibility: switch, "on or off: samples are selected by target times visibility";
    mis_visibility: switch, "on or off: targets in MIS weights are multiplied by visibility";
    visibility: choice, "ray, selected or averaged: what shading multiplies by";
    shaded: number, "an even number of neighbours whose samples are shaded beside the pixel's own";
    shading_radius: number, "the largest distance of a shaded neighbour, in pixels";
    near_radius: number, "a distance in pixels, within which neighbours are believed to see the same";
    max_plane_distance: number, "the largest distance of a neighbour from the tangent plane, in parts of the viewing distance";
    min_normal_cos: number, "the smallest cosine between the normals of neighbours";
    transmittance: switch, "on or off: light passes straight through clear glass, and is tinted";
    jitter: switch, "on or off: camera rays anywhere in the pixel";
};

/// Applies a setting of path tracing written as `key=value`.
pub(super) fn apply(settings: &mut RenderSettings, text: &str) -> Result<(), Error> {
    apply_key(Technique::Path, PATH_KEYS, settings, text)
}

fn apply_key<S>(technique: Technique, keys: &[Key<S>], settings: &mut S, text: &str) -> Result<(), Error> {
    let (name, value) = text.split_once('=').unwrap_or((text, ""));
    let Some(key) = keys.iter().find(|key| key.name == name) else {
        let known: Vec<&str> = keys.iter().map(|key| key.name).collect();
        let technique = technique.name();
        let known = known.join(", ");
        return Err(Error::Setting(format!("the technique {technique} has no setting {name:?}; it has {known}")));
    };
    (key.set)(settings, value)
        .ok_or_else(|| Error::Setting(format!("the setting {name} is {}, not {value:?}", key.values)))
}

/// Applies settings of ReSTIR DI in their order; `preset=NAME` sets all of them.
pub(super) fn apply_di(settings: &mut DiSettings, texts: &[String]) -> Result<(), Error> {
    for text in texts {
        match text.strip_prefix("preset=") {
            Some(name) => {
                *settings = DiSettings::preset(name).ok_or_else(|| {
                    let known = DiSettings::PRESETS.join(", ");
                    Error::Setting(format!("there is no preset {name:?}; there are {known}"))
                })?;
            }
            None => apply_key(Technique::RestirDi, DI_KEYS, settings, text)?,
        }
    }
    settings.check()
}

/// Refuses `--jitter` beside a setting that turns it off.
pub(super) fn check_jitter(jitter: bool, texts: &[String]) -> Result<(), Error> {
    if jitter && turn_jitter_off(texts) {
        return Err(Error::Setting(
            "--jitter and --set jitter=off contradict each other; leave one of them out".to_owned(),
        ));
    }
    Ok(())
}

/// Whether one of the settings is `jitter=off`.
pub(super) fn turn_jitter_off(texts: &[String]) -> bool {
    texts.iter().any(|text| text == "jitter=off")
}

/// The settings of ReSTIR DI as pairs, for metadata.
pub(super) fn di_pairs(settings: &DiSettings) -> impl Iterator<Item = (String, String)> {
    DI_KEYS.iter().map(|key| (key.name.to_owned(), (key.get)(settings)))
}

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The technique.
    #[arg(value_enum)]
    technique: Technique,
}

/// Lists the settings of a technique.
pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let text = match arguments.technique {
        Technique::Path => table(PATH_KEYS, &RenderSettings::default()),
        Technique::RestirDi => table(DI_KEYS, &DiSettings::default()) + &presets(),
    };
    console::print(&text)
}

fn table<S>(keys: &[Key<S>], defaults: &S) -> String {
    let mut text = String::new();
    for key in keys {
        let setting = format!("{}={}", key.name, (key.get)(defaults));
        let _ = writeln!(text, "{setting:36}  {}", key.values);
    }
    text
}

fn presets() -> String {
    let mut text = "\npresets, each what differs from the defaults:\n".to_owned();
    let defaults: Vec<_> = di_pairs(&DiSettings::default()).collect();
    for (name, preset) in DiSettings::PRESETS.iter().filter_map(|&name| Some((name, DiSettings::preset(name)?))) {
        let differs = di_pairs(&preset).zip(&defaults).filter(|(pair, default)| pair != *default);
        let differs: Vec<String> = differs.map(|((key, value), _)| format!("{key}={value}")).collect();
        let _ = writeln!(
            text,
            "preset={name}: {}",
            if differs.is_empty() { "nothing".to_owned() } else { differs.join(" ") }
        );
        for bias in preset.biases() {
            let _ = writeln!(text, "    biased: {bias}");
        }
    }
    text
}

/// A setting with names for its values.
trait Choice: Sized + Copy + 'static {
    const ALL_NAMED: &'static [(&'static str, Self)];
}

impl Choice for MisForm {
    const ALL_NAMED: &'static [(&'static str, Self)] = &Self::ALL;
}

impl Choice for Target {
    const ALL_NAMED: &'static [(&'static str, Self)] = &Self::ALL;
}

impl Choice for Visibility {
    const ALL_NAMED: &'static [(&'static str, Self)] = &Self::ALL;
}

fn choice<C: Choice>(place: &mut C, text: &str) -> Option<()> {
    *place = C::ALL_NAMED.iter().find(|(name, _)| *name == text)?.1;
    Some(())
}

fn number<T: std::str::FromStr>(place: &mut T, text: &str) -> Option<()> {
    *place = text.parse().ok()?;
    Some(())
}

fn on_off(place: &mut bool, text: &str) -> Option<()> {
    *place = match text {
        "on" => true,
        "off" => false,
        _ => return None,
    };
    Some(())
}

pub(super) fn on_or_off(value: bool) -> String {
    if value { "on" } else { "off" }.to_owned()
}
