//! Plans of renders, and their folders.

use super::document::{
    BindingEntry, BufferEntry, Document, FORMAT, KernelEntry, MOST_PASSES, ModuleEntry, NAME, OutputEntry, UploadEntry,
    VERSION,
};
use super::fold::{Fold, fields};
use super::form::{Form, Written, write};
use super::{Contents, Plan, Specialised};
use crate::output::{make_folder, making, write_atomically};
use crate::plan::{Buffer, FramePlan, Pass};
use crate::render::Render;
use crate::{Error, buffers::SceneBuffers};
use rayon::prelude::*;
use restir_kernels::{Access, KernelDesc};
use restir_shared::layout::CameraParams;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// The file of all that is written between frames.
const UPLOADS: &str = "uploads.bin";

impl Plan {
    /// What the render is made of, with the kernels in these forms.
    ///
    /// # Errors
    /// Those of [`Render::check`]; [`Error::Plan`] if it has too many passes, [`Error::Module`] if a kernel cannot be written so.
    pub fn of(render: &Render, scene: &SceneBuffers, forms: &[Form]) -> Result<Self, Error> {
        render.check(scene)?;
        let mut files = BTreeMap::new();
        let plan = render.plan(scene);
        if plan.pass_count > MOST_PASSES {
            let count = plan.pass_count;
            let problem =
                format!("the plan has {count} passes, and {MOST_PASSES} are the most; ask for fewer samples or frames");
            return Err(Error::Plan { problem });
        }
        let frames: Vec<Vec<Pass>> = render.passes_by_frame(scene).collect::<Result<_, _>>()?;
        let frame_count = frames.len() as u32;
        let mut uploads = Uploads::default();
        (0..).zip(&frames).for_each(|(frame, passes)| uploads.add(frame, passes));
        let fold = Fold::of(frames);
        let kernels = fold.kernels();
        let camera = |frame| render.camera(scene, frame).params(render.width, render.height);
        let cameras: Vec<CameraParams> = (0..frame_count).map(camera).collect();
        let document = Document {
            format: FORMAT.to_owned(),
            version: VERSION,
            generator: concat!("restir ", env!("CARGO_PKG_VERSION")).to_owned(),
            about: about(render),
            size: [render.width, render.height],
            frames: frame_count,
            buffers: (0..).zip(&plan.buffers).map(|(id, buffer)| buffer_entry(id, buffer, &mut files)).collect(),
            passes: fold.entries(&kernels, &cameras),
            kernels: kernel_entries(&kernels, forms, &mut files)?,
            uploads: uploads.entries,
            outputs: outputs(&plan),
        };
        if !uploads.words.is_empty() {
            files.insert(UPLOADS.to_owned(), Contents::Words(uploads.words.into()));
        }
        Ok(Self { document, files })
    }

    /// Writes it into a folder, which is made if it is not there. The document comes last: where it is, all is.
    ///
    /// # Errors
    /// [`Error::File`] if that cannot be.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let _making = making();
        let document = folder.join(NAME);
        if document.exists() {
            std::fs::remove_file(&document).map_err(|error| Error::cannot_write(&document, error))?;
        }
        for (name, contents) in &self.files {
            let path = folder.join(name);
            path.parent().map_or(Ok(()), make_folder)?;
            write_atomically(&path, |file| file.write_all(contents.bytes()))?;
        }
        make_folder(folder)?;
        let text = self.document.text().map_err(|error| Error::cannot_write(&document, error))?;
        write_atomically(&document, |file| file.write_all(text.as_bytes()))
    }
}

impl Document {
    /// As JSON, an entry a line.
    fn text(&self) -> Result<String, serde_json::Error> {
        let Self { format, version, generator, about, size, frames, buffers, kernels, passes, uploads, outputs } = self;
        let fields = [
            ("format", serde_json::to_string(format)?),
            ("version", version.to_string()),
            ("generator", serde_json::to_string(generator)?),
            ("about", serde_json::to_string(about)?),
            ("size", serde_json::to_string(size)?),
            ("frames", frames.to_string()),
            ("buffers", lines(buffers)?),
            ("kernels", lines(kernels)?),
            ("passes", lines(passes)?),
            ("uploads", lines(uploads)?),
            ("outputs", lines(outputs)?),
        ];
        let fields = fields.map(|(name, value)| format!("\"{name}\": {value}"));
        Ok(format!("{{\n{}\n}}\n", fields.join(",\n")))
    }
}

fn lines(entries: &[impl Serialize]) -> Result<String, serde_json::Error> {
    let lines: Vec<String> = entries.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    Ok(if lines.is_empty() { "[]".to_owned() } else { format!("[\n  {}\n]", lines.join(",\n  ")) })
}

/// What is rendered, for people.
fn about(render: &Render) -> BTreeMap<String, String> {
    let technique = render.technique.about();
    let settings = render.technique.entries().into_iter().map(|entry| format!("{}={}", entry.key, entry.value));
    let pairs = [
        ("technique", technique.name.to_owned()),
        ("settings", settings.collect::<Vec<_>>().join(",")),
        (technique.repeats.name(), render.count.to_string()),
        ("seed", render.seed.to_string()),
    ];
    pairs.map(|(key, value)| (key.to_owned(), value)).into()
}

fn buffer_entry(id: usize, buffer: &Buffer, files: &mut BTreeMap<String, Contents>) -> BufferEntry {
    let Buffer { name, words, contents } = buffer;
    let file = contents.as_ref().map(|words| {
        let file = format!("buffers/{id}-{name}.bin");
        files.insert(file.clone(), Contents::Words(words.clone()));
        file
    });
    BufferEntry { name: (*name).to_owned(), bytes: *words as u64 * 4, file }
}

/// The entries of kernels. Translating takes seconds, so that they are made side by side.
fn kernel_entries(
    kernels: &[Specialised],
    forms: &[Form],
    files: &mut BTreeMap<String, Contents>,
) -> Result<Vec<KernelEntry>, Error> {
    let written: Vec<_> =
        kernels.par_iter().map(|(kernel, constants)| write(kernel, constants, forms)).collect::<Result<_, _>>()?;
    let entries = (0..).zip(kernels.iter().zip(written)).map(|(id, ((kernel, constants), written))| {
        let mut modules = BTreeMap::new();
        for (form, Written { contents, entry, threadgroup }) in forms.iter().zip(written) {
            let file = format!("modules/{id}-{}.{}", kernel.name, form.ending());
            files.insert(file.clone(), contents);
            modules.insert(form.name().to_owned(), ModuleEntry { file, entry, threadgroup });
        }
        kernel_entry(kernel, constants, modules)
    });
    Ok(entries.collect())
}

fn kernel_entry(kernel: &KernelDesc, constants: &[u32], modules: BTreeMap<String, ModuleEntry>) -> KernelEntry {
    let names = kernel.constants.iter().map(|constant| constant.name.to_owned());
    KernelEntry {
        name: kernel.name.to_owned(),
        constants: names.zip(constants.iter().copied()).collect(),
        workgroup: kernel.workgroup,
        bindings: kernel
            .bindings
            .iter()
            .map(|b| BindingEntry { name: b.name.to_owned(), writes: b.access == Access::Own, stride: b.stride })
            .collect(),
        params: fields(kernel),
        modules,
    }
}

fn outputs(plan: &FramePlan<'_>) -> Vec<OutputEntry> {
    let image =
        plan.outputs.iter().take(1).map(|&buffer| OutputEntry { buffer, what: "image".to_owned(), counts: Vec::new() });
    let counts = plan.outputs.iter().skip(1).map(|&buffer| OutputEntry {
        buffer,
        what: "counts".to_owned(),
        counts: plan.counts.map(str::to_owned).to_vec(),
    });
    image.chain(counts).collect()
}

/// What is written between frames, of all of them in one file.
#[derive(Default)]
struct Uploads {
    entries: Vec<UploadEntry>,
    words: Vec<u32>,
}

impl Uploads {
    fn add(&mut self, frame: u32, passes: &[Pass]) {
        for upload in passes.iter().filter_map(|pass| pass.frame.as_ref()).flat_map(|frame| &frame.uploads) {
            self.entries.push(UploadEntry {
                frame,
                buffer: upload.buffer,
                byte: upload.first as u64 * 4,
                bytes: upload.words.len() as u64 * 4,
                file: UPLOADS.to_owned(),
                at: self.words.len() as u64 * 4,
            });
            self.words.extend_from_slice(&upload.words);
        }
    }
}
