//! Techniques: what turns a scene into an image.
//!
//! A technique is a struct of settings that implements [`Technique`], in a folder of its own, and a line in `techniques!`.
//! Whatever drives techniques (renders, benchmarks, references, replay, the program, the tests) takes a
//! `Box<dyn Technique>` and knows none by name.
//!
//! ```
//! use restir_host::technique::{all, configure, named};
//!
//! // by name, with settings as text, as a program has them
//! let mut technique = named("path")?;
//! configure(&mut *technique, &["max_depth=5", "sampler=independent"])?;
//! assert_eq!(technique.value("max_depth").as_deref(), Some("5"));
//! assert_eq!(technique.integral().max_depth, 5);
//!
//! // what is wrong is told in a sentence that names the setting
//! assert!(configure(&mut *technique, &["depth=5"]).unwrap_err().to_string().contains("max_depth"));
//! assert!(all().iter().all(|technique| named(technique.about().name).is_ok()));
//! # Ok::<(), restir_host::Error>(())
//! ```

#[doc(hidden)]
pub mod asked;
mod direct;
pub mod explain;
pub mod inspect;
pub mod reuse;

pub(crate) use crate::sequence;
pub use crate::sequence::pixel_filter::PixelFilter;
pub use crate::sequence::technique::{About, Diagnose, Duplicate, Integral, Repeats, Technique};
pub use direct::Direct;

use crate::Error;
use crate::settings::unknown;
use inspect::Inspect;
use std::any::Any;

/// Declares the techniques: the folder of each, and its settings.
macro_rules! techniques {
    ($($name:ident: $settings:ident),* $(,)?) => {
        $(pub mod $name;)*

        /// Every technique with its default settings, in the order in which they are listed.
        pub fn all() -> Vec<Box<dyn Technique>> {
            vec![$($name::$settings::default().into()),*]
        }

        impl dyn Technique {
            /// What explains its renders and shows their layers.
            pub fn inspect(&self) -> &dyn Inspect {
                let settings: &dyn Any = self;
                $(if let Some(own) = settings.downcast_ref::<$name::$settings>() {
                    return own;
                })*
                &inspect::Plain
            }
        }
    };
}

techniques! {
    path: PathSettings,
    restir_di: DiSettings,
    restir_pt: PtSettings,
    restir_sss: SssSettings,
    restir_suffix: SuffixSettings,
}

/// The technique of that name with its default settings.
///
/// # Errors
/// [`Error::Unknown`] for a name that there is not.
pub fn named(name: &str) -> Result<Box<dyn Technique>, Error> {
    let found = all().into_iter().find(|technique| technique.about().name == name);
    found.ok_or_else(|| unknown("technique", name, all().iter().map(|technique| technique.about().name)))
}

/// Applies settings written as `key=value`, in their order.
///
/// # Errors
/// [`Error::Technique`], around what [`crate::settings::Settings::set`] says.
pub fn configure(technique: &mut dyn Technique, texts: &[impl AsRef<str>]) -> Result<(), Error> {
    texts.iter().try_for_each(|text| {
        let (key, value) = text.as_ref().split_once('=').unwrap_or((text.as_ref(), ""));
        technique
            .set(key, value)
            .map_err(|error| Error::Technique { technique: technique.about().name, source: Box::new(error) })
    })
}
