//! What can go wrong: data, where a caller may want to act on it, and one sentence that says what is wrong and where.
//!
//! ```
//! use restir_host::{Error, scene::Scene};
//!
//! match Scene::load("teapot") {
//!     Err(Error::Scene { scene, problem }) => assert!(scene == "teapot" && problem.contains("cornell")),
//!     other => panic!("{other:?}"),
//! }
//! match restir_host::technique::named("restir") {
//!     Err(Error::Unknown { what: "technique", known, .. }) => assert!(known.contains(&"restir-di".to_owned())),
//!     other => panic!("{:?}", other.err()),
//! }
//! let mut technique = restir_host::technique::named("path")?;
//! match restir_host::technique::configure(&mut *technique, &["max_depth=deep"]) {
//!     Err(Error::Technique { technique: "path", reason }) => assert!(matches!(*reason, Error::Value { setting: "max_depth", .. })),
//!     other => panic!("{other:?}"),
//! }
//! # Ok::<(), Error>(())
//! ```

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// An error of this library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("cannot {action} {}: {reason}", path.display())]
    File {
        /// "read" or "write".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        reason: String,
    },
    /// A scene is broken or cannot be rendered.
    #[error("scene {scene}: {problem}")]
    Scene {
        /// Name or file of the scene.
        scene: String,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A name is none of those that there are.
    #[error("there is no {what} {name:?}; {}", if known.is_empty() { "there are none".to_owned() } else { format!("there are: {}", known.join(", ")) })]
    Unknown {
        /// What was named: a technique, a setting, a preset.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// A value is not one that a setting may have.
    #[error("the setting {setting} is {value}; it has to be {expected}")]
    Value {
        /// Key of the setting.
        setting: &'static str,
        /// The value, as text.
        value: String,
        /// Which values it may have.
        expected: String,
    },
    /// A technique cannot be set as it was asked for.
    #[error("{technique}: {reason}")]
    Technique {
        /// Name of the technique.
        technique: &'static str,
        /// What is wrong: a [`Self::Value`] or an [`Self::Unknown`] name.
        reason: Box<Error>,
    },
    /// Settings have values that do not go together.
    #[error("{problem}")]
    Together {
        /// Keys of the settings.
        settings: &'static [&'static str],
        /// What does not go together, and what to set instead.
        problem: String,
    },
    /// An image is larger than there are.
    #[error("an image of {}x{} pixels is too large; the longest side is {limit}", asked[0], asked[1])]
    Size {
        /// Width and height that were asked for.
        asked: [u32; 2],
        /// The longest side that an image may have.
        limit: u32,
    },
    /// Images that are to be compared differ in size.
    #[error("images of different sizes cannot be compared: {} x {} and {} x {}", test[0], test[1], reference[0], reference[1])]
    Sizes {
        /// Width and height of the image that is judged.
        test: [u32; 2],
        /// Width and height of what it is compared with.
        reference: [u32; 2],
    },
    /// Bodies cannot be filled with a medium.
    #[error("medium {medium}: {problem}")]
    Medium {
        /// Name or colour of the medium.
        medium: String,
        /// What is wrong with it, with its scale, or with the scene.
        problem: String,
    },
    /// A technique has no layers, further channels that show how the image came about.
    #[error("the technique {technique} has no layers here, because {reason}")]
    Layers {
        /// Name of the technique.
        technique: &'static str,
        /// Why it has none.
        reason: &'static str,
    },
    /// A scene has more lights than reservoirs can name.
    #[error("the scene has {count} lights and reservoirs know at most {limit}; use another technique")]
    Lights {
        /// How many it has at most, over its frames.
        count: u32,
        /// How many can be named.
        limit: u32,
    },
    /// A pixel that is to be explained is not one of the image.
    #[error("the pixel ({}, {}) is outside of the image of {} x {} pixels; count from 0, from the upper left corner", pixel[0], pixel[1], size[0], size[1])]
    Pixel {
        /// Column and row that were asked for.
        pixel: [u32; 2],
        /// Width and height of the image.
        size: [u32; 2],
    },
    /// Threads cannot be started.
    #[error("cannot start {}: {reason}; ask for fewer, or end other programs", if *count == 1 { "a thread".to_owned() } else { format!("{count} threads") })]
    Threads {
        /// How many were asked for.
        count: usize,
        /// Why not.
        reason: String,
    },
    /// Something else that was asked for cannot be.
    #[error("{0}")]
    Setting(String),
    /// No usable GPU adapter.
    #[error(transparent)]
    Adapter(#[from] AdapterError),
    /// A compiled module is missing or damaged.
    #[error("kernel {kernel}: {problem}")]
    Module {
        /// Name of the kernel.
        kernel: String,
        /// What is wrong with its module.
        problem: String,
    },
    /// A kernel does not fit its descriptor or the adapter.
    #[error("kernel {kernel}: {problem}")]
    Kernel {
        /// Name of the kernel.
        kernel: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// Something does not fit into memory, see [`crate::memory`].
    #[error("{what} would take {}, more than the limit of {} (80 % of the memory, if none was set); {remedy}", gib(*bytes), gib(*limit))]
    Memory {
        /// What does not fit.
        what: String,
        /// The bytes that it takes.
        bytes: u64,
        /// The bytes that this process may have.
        limit: u64,
        /// What to do.
        remedy: String,
    },
    /// A buffer is larger than the adapter binds.
    #[error(
        "the buffer {buffer:?} of {bytes} bytes is larger than the {limit} bytes that this adapter binds; choose a smaller size or scene"
    )]
    Binding {
        /// Name of the buffer.
        buffer: &'static str,
        /// Its bytes.
        bytes: u64,
        /// The most bytes that the adapter binds at once.
        limit: u64,
    },
    /// The adapter has no memory left.
    #[error("the adapter is out of memory ({0}); choose a smaller size or scene")]
    AdapterMemory(String),
    /// The user interrupted the work.
    #[error("interrupted; what was in work was not written")]
    Interrupted,
}

/// Why there is no adapter to work with.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AdapterError {
    /// The system has none.
    #[error("there is no GPU adapter; install a Vulkan driver (Mesa's lavapipe will do)")]
    None,
    /// None has the name that was asked for.
    #[error("no adapter has {asked:?} in its name; there are: {}", known.join(", "))]
    Named {
        /// Part of a name.
        asked: String,
        /// The names of all adapters.
        known: Vec<String>,
    },
    /// It lacks what the flavour `exact` needs.
    #[error("the flavour exact needs {what}, which {adapter} has not here; the flavour fast does without")]
    Lacks {
        /// Name of the adapter.
        adapter: String,
        /// What it lacks.
        what: &'static str,
    },
    /// It cannot be opened.
    #[error("cannot open the adapter {adapter}: {reason}")]
    Closed {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// It stopped answering, or took its results along.
    #[error("the adapter stopped answering: {0}")]
    Lost(String),
    /// It refuses what was recorded for it.
    #[error("the adapter refuses the work: {0}")]
    Refused(String),
}

impl Error {
    /// That a file cannot be read, and why.
    pub fn cannot_read(path: &Path, reason: impl Display) -> Self {
        Self::File { action: "read", path: path.to_owned(), reason: reason.to_string() }
    }

    /// That a file cannot be written, and why.
    pub fn cannot_write(path: &Path, reason: impl Display) -> Self {
        Self::File { action: "write", path: path.to_owned(), reason: reason.to_string() }
    }
}

/// Bytes as a text: in GiB, or what is less of in smaller units.
pub(crate) fn gib(bytes: u64) -> String {
    match bytes {
        0..0x400 => format!("{bytes} bytes"),
        0x400..0x10_0000 => format!("{:.1} KiB", bytes as f64 / f64::from(1 << 10)),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
        _ => format!("{:.2} GiB", bytes as f64 / f64::from(1 << 30)),
    }
}

/// Returns with a formatted problem unless a condition holds, as the macro of that name of `anyhow` does.
macro_rules! ensure {
    ($condition:expr, $($problem:tt)+) => {
        if !$condition {
            return Err(format!($($problem)+));
        }
    };
}
pub(crate) use ensure;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_never_zero_of_a_large_unit() {
        let texts = [0, 1023, 1024, 3 << 19, 0x4000_0000].map(gib);
        assert_eq!(texts, ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 MiB", "1.00 GiB"]);
    }
}
