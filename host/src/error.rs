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
//!     Err(Error::Technique { technique: "path", source }) => assert!(matches!(*source, Error::InvalidValue { setting: "max_depth", .. })),
//!     other => panic!("{other:?}"),
//! }
//! # Ok::<(), Error>(())
//! ```

use std::path::{Path, PathBuf};

/// What made something go wrong.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// A sentence that says more of a cause than it does itself.
#[derive(Debug, thiserror::Error)]
#[error("{sentence}")]
struct Explained {
    sentence: String,
    source: Cause,
}

/// A cause of whose text there is a better one: `sentence`, which says it all.
#[doc(hidden)]
pub fn explained(sentence: String, cause: impl Into<Cause>) -> Cause {
    Box::new(Explained { sentence, source: cause.into() })
}

/// An error of this library.
///
/// Its sentence has those of its [sources](std::error::Error::source) in it: print the error, and not the chain.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// "read" or "write".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        source: Cause,
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
    InvalidValue {
        /// Key of the setting.
        setting: &'static str,
        /// The value, as text.
        value: String,
        /// Which values it may have.
        expected: String,
    },
    /// A technique cannot be set as it was asked for.
    #[error("{technique}: {source}")]
    Technique {
        /// Name of the technique.
        technique: &'static str,
        /// What is wrong: an [`Self::InvalidValue`] or an [`Self::Unknown`] name.
        source: Box<Error>,
    },
    /// Settings have values that do not go together.
    #[error("{problem}")]
    ConflictingSettings {
        /// Keys of the settings.
        settings: &'static [&'static str],
        /// What does not go together, and what to set instead.
        problem: String,
    },
    /// An image has no pixel.
    #[error("an image of {}x{} pixels has no pixel; give both sides at least 1", size[0], size[1])]
    EmptyImage {
        /// Width and height that were asked for.
        size: [u32; 2],
    },
    /// A render has neither samples nor frames.
    #[error("0 {repeats} make no image; give at least 1")]
    NoRepeats {
        /// What the technique repeats.
        repeats: &'static str,
    },
    /// A session cannot make the mean that it was asked for.
    #[error("a mean of {frames} frames of {samples} samples cannot be made; give from 1 to 2^32 - 1 samples in all")]
    Mean {
        /// How many frames the mean is of.
        frames: u32,
        /// How many samples a frame has.
        samples: u32,
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
    SizeMismatch {
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
    NoLayers {
        /// Name of the technique.
        technique: &'static str,
        /// Why it has none.
        reason: &'static str,
    },
    /// A scene has more lights than reservoirs can name.
    #[error("the scene has {count} lights and reservoirs know at most {limit}; use another technique")]
    TooManyLights {
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
    #[error("cannot start {}: {source}; ask for fewer, or end other programs", if *count == 1 { "a thread".to_owned() } else { format!("{count} threads") })]
    Threads {
        /// How many were asked for.
        count: usize,
        /// Why not.
        source: Cause,
    },
    /// A camera cannot be.
    #[error("{problem}")]
    Camera {
        /// What is wrong with it, and in which frame of a path.
        problem: String,
    },
    /// An environment cannot be placed as it was asked for.
    #[error("the environment's {problem}")]
    Environment {
        /// What is wrong with its scale or turn.
        problem: String,
    },
    /// A session was given a scene of other types than its own.
    #[error("{problem}")]
    ForeignScene {
        /// What the session is over, and what to do.
        problem: &'static str,
    },
    /// A kernel asks what a foreign scene does not know.
    #[error(
        "the kernel {kernel} asks for all points of an object on a segment, of which this scene knows nothing; implement Probe for it and hand it over as Probed, or choose settings that do without"
    )]
    NotProbed {
        /// Name of the kernel.
        kernel: &'static str,
    },
    /// Primary hits cannot be given.
    #[error("{problem}")]
    PrimaryHits {
        /// Why not, and what to do.
        problem: String,
    },
    /// A texture cannot hold the image.
    #[error("the image is {image}, the texture {texture}; make one like the image")]
    Texture {
        /// Size and format of the image.
        image: String,
        /// Size and format of the texture.
        texture: String,
    },
    /// A plan cannot be made, or not be replayed.
    #[error("{problem}")]
    Plan {
        /// Why not, and what to do.
        problem: String,
    },
    /// A program around the library was asked for something that cannot be.
    #[error("{0}")]
    Setting(String),
    /// No usable GPU adapter.
    #[error(transparent)]
    Adapter(#[from] AdapterError),
    /// A compiled module is missing or damaged.
    #[error("kernel {kernel}: {source}")]
    Module {
        /// Name of the kernel.
        kernel: String,
        /// What is wrong with its module.
        source: Cause,
    },
    /// A kernel does not fit its descriptor or the adapter.
    #[error("kernel {kernel}: {source}")]
    Kernel {
        /// Name of the kernel.
        kernel: String,
        /// What is wrong and what to do.
        source: Cause,
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
    AdapterMemory(#[source] Cause),
    /// The user interrupted the work.
    #[error("interrupted; what was in work was not written")]
    Interrupted,
}

/// Why there is no adapter to work with.
#[derive(Debug, thiserror::Error)]
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
    #[error("cannot open the adapter {adapter}: {source}")]
    Closed {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        source: Cause,
    },
    /// It stopped answering, or took its results along.
    #[error("the adapter stopped answering: {0}")]
    Lost(#[source] Cause),
    /// It refuses what was recorded for it.
    #[error("the adapter refuses the work: {0}")]
    Refused(#[source] Cause),
}

impl Error {
    /// That a file cannot be read, and why.
    pub fn cannot_read(path: &Path, cause: impl Into<Cause>) -> Self {
        Self::File { action: "read", path: path.to_owned(), source: cause.into() }
    }

    /// That a file cannot be written, and why.
    pub fn cannot_write(path: &Path, cause: impl Into<Cause>) -> Self {
        Self::File { action: "write", path: path.to_owned(), source: cause.into() }
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
            return Err(format!($($problem)+).into());
        }
    };
}
pub(crate) use ensure;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_kept_and_is_in_the_sentence() {
        use std::error::Error as _;
        let found = std::io::Error::from(std::io::ErrorKind::NotFound);
        let error = Error::cannot_read(Path::new("a.exr"), explained(format!("{found}; name another"), found));
        let chain: Vec<String> =
            std::iter::successors(error.source(), |&cause| cause.source()).map(ToString::to_string).collect();
        assert_eq!(chain, ["entity not found; name another", "entity not found"]);
        assert_eq!(error.to_string(), "cannot read a.exr: entity not found; name another");
    }

    #[test]
    fn bytes_are_never_zero_of_a_large_unit() {
        let texts = [0, 1023, 1024, 3 << 19, 0x4000_0000].map(gib);
        assert_eq!(texts, ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 MiB", "1.00 GiB"]);
    }
}
