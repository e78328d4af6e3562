//! Settings of a technique as `key=value`.

use crate::Error;
use crate::render::RenderSettings;

/// Sets a value, or returns `None` if the text is not one.
type Set = fn(&mut RenderSettings, &str) -> Option<()>;

/// The keys of the technique `path`, what their values are, and how they are set.
const PATH_KEYS: &[(&str, &str, Set)] = &[
    ("roulette", "on or off", |settings, value| {
        settings.path.roulette = on_off(value)?;
        Some(())
    }),
    ("jitter", "on or off", |settings, value| {
        settings.path.jitter = on_off(value)?;
        Some(())
    }),
    ("max_depth", "a number of segments", |settings, value| {
        settings.path.max_depth = value.parse().ok()?;
        Some(())
    }),
    ("dispatch_samples", "a number of samples", |settings, value| {
        settings.dispatch_samples = Some(value.parse().ok()?);
        Some(())
    }),
];

/// Applies a setting written as `key=value`.
pub(super) fn apply(settings: &mut RenderSettings, setting: &str) -> Result<(), Error> {
    let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
    let Some((_, expected, set)) = PATH_KEYS.iter().find(|(known, ..)| *known == key) else {
        let known: Vec<&str> = PATH_KEYS.iter().map(|(known, ..)| *known).collect();
        return Err(Error::Setting(format!("the technique path has no setting {key:?}; it has {}", known.join(", "))));
    };
    set(settings, value).ok_or_else(|| Error::Setting(format!("the setting {key} is {expected}, not {value:?}")))
}

fn on_off(value: &str) -> Option<bool> {
    match value {
        "on" => Some(true),
        "off" => Some(false),
        _ => None,
    }
}
