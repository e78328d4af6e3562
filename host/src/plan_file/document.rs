//! What `plan.json` says, entry by entry.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the document says that it is.
pub const FORMAT: &str = "restir-plan";
/// The version of the format. A reader of one version refuses others.
pub const VERSION: u32 = 1;
/// The most passes that the frames of a plan have together: documents of more are no use to anybody.
pub(super) const MOST_PASSES: u64 = 1 << 16;
/// The document's name in its folder.
pub const NAME: &str = "plan.json";

/// A render as data. All sizes are in bytes, all words are of 32 bits, and files have the least byte first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// The program that wrote it.
    pub generator: String,
    /// What is rendered, for people: scene, technique, settings.
    pub about: BTreeMap<String, String>,
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    /// How many frames there are.
    pub frames: u32,
    /// The buffers, which passes and uploads name by their index.
    pub buffers: Vec<BufferEntry>,
    /// The kernels, which passes name by their index.
    pub kernels: Vec<KernelEntry>,
    /// The passes in their order within a frame.
    pub passes: Vec<PassEntry>,
    /// What is written to buffers before the first pass of a frame.
    pub uploads: Vec<UploadEntry>,
    /// The buffers that hold the results after each frame in which the pass runs that writes them. The image comes first.
    pub outputs: Vec<OutputEntry>,
}

/// A storage buffer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BufferEntry {
    /// A name, for messages; several may have the same.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// The file of its first contents; it begins with zeros if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

/// A kernel, specialised to the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KernelEntry {
    /// Its name.
    pub name: String,
    /// Its specialization constants, which are frozen in its modules.
    pub constants: BTreeMap<String, u32>,
    /// Invocations in a workgroup.
    pub workgroup: [u32; 3],
    /// Its storage buffers: the index is the binding in set 0. The first one holds the parameters of the pass.
    pub bindings: Vec<BindingEntry>,
    /// The fields of the parameters.
    pub params: Vec<FieldEntry>,
    /// Its modules by language.
    pub modules: BTreeMap<String, ModuleEntry>,
}

/// A binding of a kernel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BindingEntry {
    /// The role of what is bound.
    pub name: String,
    /// Whether the kernel writes it.
    pub writes: bool,
    /// Size of an element.
    pub stride: u32,
}

/// A field of a parameter block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldEntry {
    /// Its name, after those of the blocks around it: `camera.position`.
    pub name: String,
    /// Its first byte.
    pub byte: u32,
    /// `u32` or `f32`.
    #[serde(rename = "type")]
    pub kind: String,
    /// How many of them.
    pub count: u32,
}

/// A compiled or translated kernel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleEntry {
    /// Its file.
    pub file: String,
    /// The name of its entry point.
    pub entry: String,
    /// Sizes of the memory that a workgroup shares, in bytes, where the host has to give it (MSL: `setThreadgroupMemoryLength`, index by index).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub threadgroup: Vec<u32>,
}

/// A dispatch that is the same in all the frames in which it runs, but for the buffers that alternate and the parameters that change. Both are
/// lists: the k-th time that the pass runs, from 0 on, it takes entry k, and where a list ends it begins anew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassEntry {
    /// The index of its kernel.
    pub kernel: usize,
    /// The frames in which it runs, as ranges: first and last.
    pub frames: Vec<[u32; 2]>,
    /// The buffers that it binds, by role.
    pub buffers: BTreeMap<String, Vec<usize>>,
    /// Width and height of the grid in invocations.
    pub grid: [u32; 2],
    /// How many workgroups cover the grid.
    pub workgroups: [u32; 3],
    /// The words of its parameters the first time.
    pub params: Vec<u32>,
    /// The fields of its parameters that are others at other times.
    pub changes: Vec<ChangeEntry>,
}

/// A field that changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangeEntry {
    /// Its name.
    pub field: String,
    /// Its first byte.
    pub byte: u32,
    /// Its words, time by time.
    pub values: Vec<Vec<u32>>,
    /// What it is in every frame: `camera` or `last_camera`, the field of that name of the frame's camera or of the last frame's; `frame` or
    /// `last_frame`, how many frames there were before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub follows: Option<String>,
}

/// Bytes of a file that are written to a buffer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UploadEntry {
    /// The frame.
    pub frame: u32,
    /// The buffer.
    pub buffer: usize,
    /// The first byte in the buffer.
    pub byte: u64,
    /// How many.
    pub bytes: u64,
    /// The file.
    pub file: String,
    /// The first byte in the file.
    pub at: u64,
}

/// A result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputEntry {
    /// The buffer, pixel by pixel in rows from the top.
    pub buffer: usize,
    /// `image` has four floats a pixel: the mean radiance, linear red, green and blue, and how many samples were dropped. `counts` has four
    /// words a pixel.
    pub what: String,
    /// What the words of `counts` count; nothing, where a name is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<String>,
}
