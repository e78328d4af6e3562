//! Plans of folders, and the passes that they stand for.

use super::document::{Document, FORMAT, KernelEntry, MOST_PASSES, NAME, PassEntry, UploadEntry, VERSION};
use super::fold::fields;
use super::{Contents, Plan, Specialised};
use crate::input;
use crate::plan::{Buffer, BufferId, FramePlan, Pass, SceneFrame, Upload};
use crate::{Error, memory};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Component, Path};

impl Plan {
    /// Reads what [`Plan::write`] has written.
    ///
    /// # Errors
    /// [`Error::File`] if a file cannot be read, or the document is of another version, damaged, or names files outside of its folder.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(NAME);
        let unread = |problem: String| Error::cannot_read(&path, problem);
        let text = read(&path)?;
        let Header { format, version } = serde_json::from_slice(&text).map_err(|e| unread(damaged(&e)))?;
        if format != FORMAT || version != VERSION {
            let problem = format!("it is version {version} of {format:?}, and {VERSION} of {FORMAT:?} is read here");
            return Err(unread(format!("{problem}; export the plan again")));
        }
        let document: Document = serde_json::from_slice(&text).map_err(|e| unread(damaged(&e)))?;
        let mut files = BTreeMap::new();
        for name in named(&document) {
            let is_inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
            let inside = is_inside.then(|| folder.join(name));
            let file =
                inside.ok_or_else(|| unread(format!("it names the file {name:?}, which is not in its folder")))?;
            files.insert(name.to_owned(), contents(&file)?);
        }
        Ok(Self { document, files })
    }

    /// The passes that it stands for, with this library's own kernels.
    ///
    /// # Errors
    /// [`Error::Plan`] if the kernels are not those of this version, or entries do not fit each other.
    pub fn frames(&self) -> Result<FramePlan<'static>, Error> {
        self.check_size()?;
        let document = &self.document;
        let kernels: Vec<Specialised> = document.kernels.iter().map(specialised).collect::<Result<_, _>>()?;
        let names = names(document, &kernels);
        let buffers: Vec<Buffer> =
            (0..).zip(names).map(|(id, name)| self.buffer(id, name)).collect::<Result<_, _>>()?;
        let mut passes = Vec::new();
        let mut times = vec![0; document.passes.len()];
        for frame in 0..document.frames {
            passes.extend(self.frame(frame, &kernels, &mut times)?);
        }
        passes.iter().try_for_each(|pass| pass.check(&buffers))?;
        let outputs: Vec<BufferId> = document.outputs.iter().map(|output| output.buffer).collect();
        let are_there = outputs.iter().all(|&output| output < buffers.len());
        if are_there { Ok(FramePlan::of(buffers, passes, outputs)) } else { Err(misfit("an output")) }
    }

    /// Whether it has no more passes than a plan may have, and fits into memory.
    fn check_size(&self) -> Result<(), Error> {
        let Document { frames, passes, buffers, .. } = &self.document;
        let ranges = passes.iter().flat_map(|pass| &pass.frames);
        let runs: u64 = ranges.map(|[first, last]| u64::from(last.saturating_sub(*first)) + 1).sum();
        if u64::from(*frames).max(runs) > MOST_PASSES {
            let problem = format!("the plan has more than {MOST_PASSES} frames or passes; export it again");
            return Err(Error::Plan { problem });
        }
        let bytes = buffers.iter().map(|buffer| buffer.bytes).fold(0, u64::saturating_add);
        memory::check(bytes, "this plan", "export it with a smaller size")
    }

    /// The passes of a frame; `times` counts how often each has run.
    fn frame(&self, frame: u32, kernels: &[Specialised], times: &mut [usize]) -> Result<Vec<Pass>, Error> {
        let mut passes = Vec::new();
        for (entry, time) in self.document.passes.iter().zip(times) {
            if entry.frames.iter().any(|[first, last]| (*first..=*last).contains(&frame)) {
                passes.push(pass(entry, kernels, *time)?);
                *time += 1;
            }
        }
        let of_frame = self.document.uploads.iter().filter(|upload| upload.frame == frame);
        let uploads: Vec<Upload> = of_frame.map(|upload| self.upload(upload)).collect::<Result<_, _>>()?;
        if let (Some(first), false) = (passes.first_mut(), uploads.is_empty()) {
            first.frame = Some(SceneFrame { uploads, scenes: None });
        }
        Ok(passes)
    }

    fn buffer(&self, id: BufferId, name: &'static str) -> Result<Buffer, Error> {
        let entry = &self.document.buffers[id];
        let words = entry.file.as_ref().map(|file| self.words(file)).transpose()?;
        let contents = words.map(|words| (words.len() as u64 * 4 == entry.bytes).then(|| words.clone()));
        match contents {
            Some(None) => Err(misfit(&format!("buffer {id}"))),
            contents => Ok(Buffer { name, words: (entry.bytes / 4) as usize, contents: contents.flatten() }),
        }
    }

    fn words(&self, file: &str) -> Result<&std::sync::Arc<[u32]>, Error> {
        match self.files.get(file) {
            Some(Contents::Words(words)) => Ok(words),
            _ => Err(misfit(&format!("the file {file}"))),
        }
    }

    fn upload(&self, entry: &UploadEntry) -> Result<Upload, Error> {
        let words = self.words(&entry.file)?;
        let range = (entry.at / 4) as usize..((entry.at.saturating_add(entry.bytes)) / 4) as usize;
        let words = words.get(range).ok_or_else(|| misfit("an upload"))?.into();
        Ok(Upload { buffer: entry.buffer, first: (entry.byte / 4) as usize, words })
    }
}

/// What every version says first.
#[derive(serde::Deserialize)]
struct Header {
    format: String,
    version: u32,
}

fn damaged(error: &serde_json::Error) -> String {
    format!("it is no plan, or damaged ({error}); export it again")
}

fn misfit(what: &str) -> Error {
    Error::Plan { problem: format!("{what} of the plan does not fit the rest of it; export it again") }
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let opened = input::open(path).and_then(|mut file| file.read_to_end(&mut bytes));
    opened.map_err(|error| Error::cannot_read(path, error))?;
    Ok(bytes)
}

/// Words of files of buffers and of SPIR-V, else text.
fn contents(path: &Path) -> Result<Contents, Error> {
    let bytes = read(path)?;
    if path.extension().is_some_and(|ending| ending == "bin" || ending == "spv") {
        let whole = bytes.len().is_multiple_of(4);
        let cut = || Error::cannot_read(path, "it does not end with a whole word; export the plan again");
        return whole.then(|| Contents::Words(bytemuck::pod_collect_to_vec(&bytes).into())).ok_or_else(cut);
    }
    String::from_utf8(bytes).map(Contents::Text).map_err(|error| Error::cannot_read(path, error))
}

/// All files that a document names.
fn named(document: &Document) -> BTreeSet<&str> {
    let buffers = document.buffers.iter().filter_map(|buffer| buffer.file.as_deref());
    let modules = document.kernels.iter().flat_map(|kernel| kernel.modules.values()).map(|module| module.file.as_str());
    buffers.chain(modules).chain(document.uploads.iter().map(|upload| upload.file.as_str())).collect()
}

/// The kernel of that name, if it is the one that the entry describes.
fn specialised(entry: &KernelEntry) -> Result<Specialised, Error> {
    let other = || Error::Plan {
        problem: format!("the kernel {} is of another version of restir; export the plan by this one", entry.name),
    };
    let kernel = restir_kernels::all().into_iter().find(|kernel| kernel.name == entry.name).ok_or_else(other)?;
    let bindings = kernel.bindings.iter().map(|binding| (binding.name, binding.stride));
    let same = fields(kernel) == entry.params
        && bindings.eq(entry.bindings.iter().map(|binding| (binding.name.as_str(), binding.stride)));
    let constants = kernel.constants.iter().map(|constant| entry.constants.get(constant.name).copied());
    let constants: Option<Vec<u32>> = constants.collect();
    constants.filter(|_| same).map(|constants| (kernel, constants)).ok_or_else(other)
}

/// A name for each buffer: the role in which it is bound first.
fn names(document: &Document, kernels: &[Specialised]) -> Vec<&'static str> {
    let mut names = vec!["unused"; document.buffers.len()];
    for pass in document.passes.iter().rev() {
        let bindings = kernels.get(pass.kernel).map_or(&[][..], |(kernel, _)| kernel.bindings);
        for binding in bindings {
            for &id in pass.buffers.get(binding.name).into_iter().flatten() {
                names.iter_mut().skip(id).take(1).for_each(|name| *name = binding.name);
            }
        }
    }
    names
}

/// An entry as it runs for the `time`-th time.
fn pass(entry: &PassEntry, kernels: &[Specialised], time: usize) -> Result<Pass, Error> {
    let (kernel, constants) = kernels.get(entry.kernel).ok_or_else(|| misfit("a kernel"))?;
    let has_block = kernel.bindings.first().is_some_and(|block| block.stride as usize == 4 * entry.params.len());
    has_block.then_some(()).ok_or_else(|| misfit("a parameter block"))?;
    let turn = |ids: &Vec<BufferId>| ids.get(time.checked_rem(ids.len())?).copied();
    let roles = kernel.bindings.iter().skip(1);
    let bindings: Option<Vec<BufferId>> = roles.map(|role| entry.buffers.get(role.name).and_then(turn)).collect();
    let mut params = entry.params.clone();
    for change in &entry.changes {
        let words = time.checked_rem(change.values.len()).map_or(&[][..], |turn| &change.values[turn]);
        let first = change.byte as usize / 4;
        let target = params.get_mut(first..first + words.len()).ok_or_else(|| misfit("a change"))?;
        target.copy_from_slice(words);
    }
    let bindings = bindings.ok_or_else(|| misfit("a binding"))?;
    Ok(Pass { frame: None, kernel, constants: constants.clone(), params, bindings, grid: entry.grid, waiting: None })
}
