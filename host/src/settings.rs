//! Settings of techniques, each declared once.
//!
//! [`settings!`](crate::settings!) declares a struct of settings: a line has the field, its type, its default, its range and its unit, and
//! the doc comment above it is the text of `restir settings`. The field's name is the key in `--set key=value`, in an
//! image's metadata and in reports.
//!
//! Whoever has a struct of settings reads and changes it by its fields, or by keys and texts:
//!
//! ```
//! use restir_host::settings::Settings;
//! use restir_host::technique::path::PathSettings;
//!
//! let mut settings = PathSettings::default();
//! settings.set("max_depth", "12")?;
//! assert_eq!(settings.max_depth, 12);
//! assert!(settings.set("max_depth", "many").is_err());
//!
//! // a value out of range is told with the range
//! settings.max_depth = 0;
//! assert!(settings.check_ranges().unwrap_err().to_string().contains("max_depth"));
//! assert!(settings.entries().iter().any(|entry| entry.key == "jitter" && entry.value == "on"));
//! # Ok::<(), restir_host::Error>(())
//! ```

use crate::Error;
use restir_shared::resample::mis::Mis;
use restir_shared::rng::Sampler;

/// A type that settings may have, as text.
pub trait Value: Sized {
    /// What a text has to be, as in "on or off".
    fn expected() -> String;
    /// The value that a text means, if it is one.
    fn read(text: &str) -> Option<Self>;
    /// The text that [`Self::read`] gives the value for.
    fn write(&self) -> String;
}

macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl Value for $type {
            fn expected() -> String {
                "a number".to_owned()
            }

            fn read(text: &str) -> Option<Self> {
                text.parse().ok()
            }

            fn write(&self) -> String {
                self.to_string()
            }
        }
    )*};
}

numbers!(u32, f32);

impl Value for bool {
    fn expected() -> String {
        "on or off".to_owned()
    }

    fn read(text: &str) -> Option<Self> {
        Some(text == "on").filter(|&on| on || text == "off")
    }

    fn write(&self) -> String {
        if *self { "on" } else { "off" }.to_owned()
    }
}

macro_rules! named {
    ($($type:ty),*) => {$(
        impl Value for $type {
            fn expected() -> String {
                Self::NAMED.map(|(name, _)| name).join(" | ")
            }

            fn read(text: &str) -> Option<Self> {
                Self::NAMED.iter().find(|(name, _)| *name == text).map(|&(_, value)| value)
            }

            fn write(&self) -> String {
                Self::NAMED.iter().find(|(_, value)| value == self).map_or("", |(name, _)| name).to_owned()
            }
        }
    )*};
}

named!(Mis, Sampler);

/// A value, or `off`.
impl<V: Value> Value for Option<V> {
    fn expected() -> String {
        format!("off or {}", V::expected())
    }

    fn read(text: &str) -> Option<Self> {
        if text == "off" { Some(None) } else { V::read(text).map(Some) }
    }

    fn write(&self) -> String {
        self.as_ref().map_or_else(|| "off".to_owned(), V::write)
    }
}

/// A field of a struct that may get more fields with any version: who writes one ends it by `..`, as in
/// `PathSettings { max_depth: 3, ..PathSettings::default() }`.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct More(());

/// An enumeration of named values, as [`choices!`](crate::choices!) declares it.
pub trait Choice: Copy + PartialEq + 'static {
    /// All values, in the order in which they are listed.
    const ALL: &'static [Self];

    /// The name in `--set key=name`.
    fn name(self) -> &'static str;
}

impl<C: Choice> Value for C {
    fn expected() -> String {
        C::ALL.iter().map(|choice| choice.name()).collect::<Vec<_>>().join(" | ")
    }

    fn read(text: &str) -> Option<Self> {
        C::ALL.iter().copied().find(|choice| choice.name() == text)
    }

    fn write(&self) -> String {
        self.name().to_owned()
    }
}

/// Declares an enumeration of named values, in the order in which they are listed.
///
/// ```
/// use restir_host::settings::Choice;
///
/// restir_host::choices! {
///     /// What to have for breakfast.
///     pub enum Breakfast {
///         /// Coffee alone.
///         "coffee" => Coffee,
///         /// Bread.
///         "bread" => Bread,
///     }
/// }
/// assert!(Breakfast::ALL.iter().map(|choice| choice.name()).eq(["coffee", "bread"]));
/// ```
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* pub enum $type:ident { $($(#[$doc:meta])* $name:literal => $variant:ident),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum $type {
            $($(#[$doc])* $variant,)*
        }

        impl $crate::settings::Choice for $type {
            const ALL: &'static [Self] = &[$(Self::$variant),*];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

/// A setting of `S` as it was declared.
#[derive(Debug)]
pub struct Setting<S: 'static> {
    /// The field's name.
    pub key: &'static str,
    /// The field's documentation.
    pub doc: &'static str,
    /// What values are counted or measured in; empty where they have no unit.
    pub unit: &'static str,
    /// What a value has to be.
    pub expected: fn() -> String,
    /// The value as text.
    pub get: fn(&S) -> String,
    /// Sets the value that a text means, and says whether it is one.
    pub set: fn(&mut S, &str) -> bool,
    /// Whether the value is in the declared range.
    pub in_range: fn(&S) -> bool,
}

/// A struct of settings that [`settings!`](crate::settings!) has declared.
pub trait Declared: Clone + Default + 'static {
    /// The settings, in the order of the fields.
    const SETTINGS: &'static [Setting<Self>];
    /// Names of presets, each of which sets everything.
    const PRESETS: &'static [&'static str];
    /// The preset of a name in [`Self::PRESETS`].
    fn preset(name: &str) -> Option<Self>;
}

/// A setting and its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The key.
    pub key: &'static str,
    /// The value as text.
    pub value: String,
    /// What a value has to be, with its unit.
    pub expected: String,
    /// What the setting does.
    pub doc: String,
}

/// Settings by key and text, whatever their type is.
pub trait Settings {
    /// All settings with their values.
    fn entries(&self) -> Vec<Entry>;

    /// Sets a value; the key `preset` sets all of them.
    ///
    /// # Errors
    /// [`Error::Unknown`] for a key or preset that there is not, [`Error::InvalidValue`] for a text that is no value.
    fn set(&mut self, key: &str, value: &str) -> Result<(), Error>;

    /// The presets by name, each with the settings that differ from the defaults.
    fn presets(&self) -> Vec<(&'static str, Vec<Entry>)>;

    /// Whether every value is in its range.
    ///
    /// # Errors
    /// [`Error::InvalidValue`] that names the first that is not, and its range.
    fn check_ranges(&self) -> Result<(), Error>;

    /// The value of a setting as text; `None` if there is no such key.
    fn value(&self, key: &str) -> Option<String> {
        self.entries().into_iter().find(|entry| entry.key == key).map(|entry| entry.value)
    }
}

/// The error for a name that is none of those that there are.
pub(crate) fn unknown(what: &'static str, name: &str, known: impl Iterator<Item = &'static str>) -> Error {
    Error::Unknown { what, name: name.to_owned(), known: known.map(str::to_owned).collect() }
}

impl<S: Declared> Settings for S {
    fn entries(&self) -> Vec<Entry> {
        let entry = |setting: &Setting<S>| Entry {
            key: setting.key,
            value: (setting.get)(self),
            expected: [&(setting.expected)(), setting.unit].join(" ").trim().to_owned(),
            doc: setting.doc.split_whitespace().collect::<Vec<_>>().join(" "),
        };
        S::SETTINGS.iter().map(entry).collect()
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), Error> {
        if key == "preset" {
            *self = S::preset(value).ok_or_else(|| unknown("preset", value, S::PRESETS.iter().copied()))?;
            return Ok(());
        }
        let keys = S::SETTINGS.iter().map(|setting| setting.key);
        let setting = S::SETTINGS.iter().find(|setting| setting.key == key);
        let setting = setting.ok_or_else(|| unknown("setting", key, keys))?;
        if (setting.set)(self, value) {
            return Ok(());
        }
        Err(Error::InvalidValue { setting: setting.key, value: format!("{value:?}"), expected: (setting.expected)() })
    }

    fn presets(&self) -> Vec<(&'static str, Vec<Entry>)> {
        let defaults = S::default().entries();
        let differing = |preset: S| preset.entries().into_iter().filter(|entry| !defaults.contains(entry)).collect();
        S::PRESETS.iter().filter_map(|&name| Some((name, differing(S::preset(name)?)))).collect()
    }

    fn check_ranges(&self) -> Result<(), Error> {
        S::SETTINGS.iter().find(|setting| !(setting.in_range)(self)).map_or(Ok(()), |setting| {
            Err(Error::InvalidValue {
                setting: setting.key,
                value: (setting.get)(self),
                expected: (setting.expected)(),
            })
        })
    }
}

/// Declares a struct of settings with its defaults, ranges, units and presets: see [`Declared`].
///
/// ```
/// restir_host::settings! {
///     /// How to boil an egg.
///     pub struct Egg {
///         /// Time in the water.
///         minutes: f32 = 4.5, in 0.0..=15.0, unit "minutes";
///         /// Whether it is salted.
///         salt: bool = true;
///     }
///     presets { "hard" => Egg { minutes: 10.0, ..Egg::default() } }
/// }
/// use restir_host::settings::Settings;
/// let mut egg = Egg::default();
/// egg.set("minutes", "7").unwrap();
/// assert_eq!((egg.minutes, egg.value("salt").as_deref()), (7.0, Some("on")));
/// egg.set("minutes", "20").unwrap();
/// assert!(egg.check_ranges().unwrap_err().to_string().contains("from 0 to 15"));
/// ```
#[macro_export]
macro_rules! settings {
    (
        $(#[$meta:meta])*
        pub struct $type:ident {
            $($(#[doc = $doc:literal])* $field:ident: $value:ty = $default:expr $(, in $range:expr)? $(, unit $unit:literal)?;)*
        }
        $(presets { $($preset:literal => $settings:expr),* $(,)? })?
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $type {
            $($(#[doc = $doc])* pub $field: $value,)*
            #[doc(hidden)]
            pub _more: $crate::settings::More,
        }

        impl Default for $type {
            fn default() -> Self {
                Self { $($field: $default,)* _more: Default::default() }
            }
        }

        impl $crate::settings::Declared for $type {
            const SETTINGS: &'static [$crate::settings::Setting<Self>] = &[$($crate::settings::Setting {
                key: stringify!($field),
                doc: concat!($($doc),*),
                unit: concat!("", $($unit)?),
                expected: || {
                    #[allow(unused_mut, reason = "not all settings have a range")]
                    let mut expected = <$value as $crate::settings::Value>::expected();
                    $(expected += &format!(" from {} to {}", $range.start(), $range.end());)?
                    expected
                },
                get: |settings| $crate::settings::Value::write(&settings.$field),
                set: |settings, text| {
                    $crate::settings::Value::read(text).map(|value| settings.$field = value).is_some()
                },
                in_range: |settings| {
                    let _ = settings;
                    true $(&& $range.contains(&settings.$field))?
                },
            }),*];
            const PRESETS: &'static [&'static str] = &[$($($preset),*)?];

            fn preset(name: &str) -> Option<Self> {
                match name {
                    $($($preset => Some($settings),)*)?
                    _ => None,
                }
            }
        }
    };
}
