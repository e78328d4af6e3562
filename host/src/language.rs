//! `fast` modules in other shading languages, as naga writes them.
//!
//! ```
//! use restir_host::language::{Language, Parsed};
//! use restir_kernels::spirv::file;
//!
//! let module = file("fast/film_add.spv").expect("a module of every kernel");
//! let parsed = Parsed::new(module, "film_add")?;
//! let wgsl = parsed.write(Language::Wgsl)?;
//! assert!(wgsl.text.contains("@compute @workgroup_size(8, 8, 1)"));
//! assert_eq!(wgsl.entry, "film_add");
//! // bindings of set 0 keep their numbers in every language
//! assert!(parsed.write(Language::Glsl)?.text.contains("layout(std430, binding = 2)"));
//! # Ok::<(), String>(())
//! ```

use naga::back::pipeline_constants::process_overrides;
use naga::back::{PipelineConstants, glsl, hlsl, msl, wgsl};
use naga::front::spv;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, ResourceBinding, ShaderStage, StorageAccess};
use std::error::Error;
use std::fmt::{Debug, Display, Formatter};

/// No kernel reads of a workgroup's memory what it has not written.
const ZERO_INITIALIZE: bool = false;

/// The largest float as naga writes it, by digits that are a little more than it is, which Chrome's compiler refuses; and as WGSL has it exactly.
const LARGEST: [&str; 2] = ["340282350000000000000000000000000000000f", "0x1.fffffep+127f"];

/// A shading language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Language {
    /// WebGPU's.
    Wgsl,
    /// Metal's, version 2.4. Binding i of set 0 is buffer i; the buffer after the last one holds the sizes in bytes of all but the first, in their
    /// order, a word each. The host gives the memory that workgroups share ([`Parsed::workgroup_memory`]).
    Msl,
    /// Direct3D's, shader model 5.1: binding i of set 0 is register i of space 0, `t` if it is only read and `u` if not.
    Hlsl,
    /// OpenGL's and Vulkan's, version 4.50: binding i of set 0 is binding i.
    Glsl,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Wgsl, Self::Msl, Self::Hlsl, Self::Glsl];

    /// What it is called, which is how files of it end.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Msl => "msl",
            Self::Hlsl => "hlsl",
            Self::Glsl => "glsl",
        }
    }
}

impl Display for Language {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// A kernel in a shading language.
#[derive(Clone, Debug)]
pub struct Source {
    /// The text.
    pub text: String,
    /// The name of the entry point in it.
    pub entry: String,
}

/// A module that naga has read and found valid.
pub struct Parsed {
    module: naga::Module,
    info: ModuleInfo,
    entry: String,
}

impl Debug for Parsed {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Parsed").field("entry", &self.entry).finish_non_exhaustive()
    }
}

impl Parsed {
    /// Reads a SPIR-V module. `entry` is its entry point, a compute kernel.
    ///
    /// # Errors
    /// What naga finds wrong with it; it knows no float controls, which `exact` modules have.
    pub fn new(module: &[u8], entry: &str) -> Result<Self, String> {
        let module = spv::parse_u8_slice(module, &spv::Options::default()).map_err(|e| rejects("the module", &e))?;
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).map_err(|e| rejects("its translation", e.as_inner()))?;
        Ok(Self { module, info, entry: entry.to_owned() })
    }

    /// The kernel in a language. Only WGSL keeps specialization constants; the others have their defaults.
    ///
    /// # Errors
    /// Why naga cannot write it.
    pub fn write(&self, language: Language) -> Result<Source, String> {
        let Self { module, info, entry } = self;
        let named = |text| Source { text, entry: entry.clone() };
        if language == Language::Wgsl {
            let written = wgsl::write_string(module, info, wgsl::WriterFlags::empty());
            let [inexact, exact] = LARGEST;
            return written.map(|text| named(text.replace(inexact, exact))).map_err(|e| cannot_write(language, &e));
        }
        let stage = Some((ShaderStage::Compute, entry.as_str()));
        let (module, info) = process_overrides(module, info, stage, &PipelineConstants::default())
            .map_err(|e| rejects("its specialization", &e))?;
        match language {
            Language::Wgsl | Language::Msl => self.msl(&module, &info),
            Language::Hlsl => self.hlsl(&module, &info),
            Language::Glsl => self.glsl(&module, &info),
        }
        .map_err(|e| cannot_write(language, &*e))
    }

    /// The sizes in bytes of the variables that a workgroup shares, in the order of the arguments by which MSL takes them.
    pub fn workgroup_memory(&self) -> Vec<u32> {
        let used = self.info.get_entry_point(0);
        let is_shared = |variable: &naga::GlobalVariable| variable.space == AddressSpace::WorkGroup;
        let variables = self.module.global_variables.iter();
        let shared = variables.filter(|(at, variable)| is_shared(variable) && !used[*at].is_empty());
        shared.map(|(_, variable)| self.module.types[variable.ty].inner.size(self.module.to_ctx())).collect()
    }

    /// The storage buffers, and whether each is written.
    fn buffers(&self) -> impl Iterator<Item = (ResourceBinding, bool)> {
        self.module.global_variables.iter().filter_map(|(_, variable)| match variable.space {
            AddressSpace::Storage { access } => Some((variable.binding?, access.contains(StorageAccess::STORE))),
            _ => None,
        })
    }

    fn msl(&self, module: &naga::Module, info: &ModuleInfo) -> Result<Source, Box<dyn Error>> {
        let slot = |number: u32| u8::try_from(number).ok();
        let target = |(binding, mutable): (ResourceBinding, bool)| {
            let target = msl::BindTarget { buffer: slot(binding.binding), mutable, ..Default::default() };
            (binding, target)
        };
        let last = self.buffers().map(|(binding, _)| binding.binding).max().unwrap_or(0);
        let resources = msl::EntryPointResources {
            resources: self.buffers().map(target).collect(),
            sizes_buffer: slot(last + 1),
            ..Default::default()
        };
        let options = msl::Options {
            // what wgpu asks for on current systems
            lang_version: (2, 4),
            per_entry_point_map: [(self.entry.clone(), resources)].into(),
            fake_missing_bindings: false,
            zero_initialize_workgroup_memory: ZERO_INITIALIZE,
            ..Default::default()
        };
        let (text, names) = msl::write_string(module, info, &options, &Default::default())?;
        let entry = names.entry_point_names.into_iter().next().ok_or("it has no entry point")??;
        Ok(Source { text, entry })
    }

    fn hlsl(&self, module: &naga::Module, info: &ModuleInfo) -> Result<Source, Box<dyn Error>> {
        let options = hlsl::Options { zero_initialize_workgroup_memory: ZERO_INITIALIZE, ..Default::default() };
        let (mut text, pipeline) = (String::new(), hlsl::PipelineOptions::default());
        let names = hlsl::Writer::new(&mut text, &options, &pipeline).write(module, info, None)?;
        let entry = names.entry_point_names.into_iter().next().ok_or("it has no entry point")??;
        Ok(Source { text, entry })
    }

    fn glsl(&self, module: &naga::Module, info: &ModuleInfo) -> Result<Source, Box<dyn Error>> {
        let bound = self.buffers().filter_map(|(binding, _)| Some((binding, u8::try_from(binding.binding).ok()?)));
        let options = glsl::Options {
            version: glsl::Version::Desktop(450),
            binding_map: bound.collect(),
            zero_initialize_workgroup_memory: ZERO_INITIALIZE,
            ..Default::default()
        };
        let entry_point = self.entry.clone();
        let pipeline = glsl::PipelineOptions { shader_stage: ShaderStage::Compute, entry_point, multiview: None };
        let mut text = String::new();
        glsl::Writer::new(&mut text, module, info, &options, &pipeline, Default::default())?.write()?;
        Ok(Source { text, entry: "main".to_owned() })
    }
}

/// An error and its causes.
fn chain(error: &(dyn Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |&error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn rejects(step: &str, error: &(dyn Error + 'static)) -> String {
    format!("naga rejects {step}: {}", chain(error))
}

fn cannot_write(language: Language, error: &(dyn Error + 'static)) -> String {
    format!("naga cannot write {}: {}", language.name().to_uppercase(), chain(error))
}
