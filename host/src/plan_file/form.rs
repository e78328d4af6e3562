//! Forms of kernels: SPIR-V and shading languages.

use crate::exec::Flavour;
use crate::language::{Language, Parsed};
use crate::plan_file::Contents;
use crate::{Error, Shaders};
use restir_kernels::KernelDesc;

/// What a kernel is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Form {
    /// An `exact` module, which gives the host's bits on Vulkan.
    Spirv,
    /// A `fast` module in a shading language: the same image within rounding.
    Text(Language),
}

impl Form {
    /// All of them.
    pub fn all() -> Vec<Self> {
        std::iter::once(Self::Spirv).chain(Language::ALL.map(Self::Text)).collect()
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spirv => "spirv",
            Self::Text(language) => language.name(),
        }
    }

    /// How its files end.
    pub(super) fn ending(self) -> &'static str {
        if self == Self::Spirv { "spv" } else { self.name() }
    }
}

/// A kernel in a form.
pub(super) struct Written {
    pub(super) contents: Contents,
    /// The name of its entry point.
    pub(super) entry: String,
    /// Sizes of the memory that the host gives to a workgroup.
    pub(super) threadgroup: Vec<u32>,
}

/// A kernel with its constants frozen, in each of the forms.
pub(super) fn write(kernel: &KernelDesc, constants: &[u32], forms: &[Form]) -> Result<Vec<Written>, Error> {
    let broken = |source: String| Error::Module { kernel: kernel.name.to_owned(), source: source.into() };
    let frozen = |flavour| Shaders::Embedded.specialised(kernel, constants, flavour);
    // read once for all languages
    let mut parsed = None;
    let mut written = |form: &Form| {
        let language = match form {
            Form::Spirv => {
                let contents = Contents::Words(frozen(Flavour::Exact)?.into());
                return Ok(Written { contents, entry: kernel.name.to_owned(), threadgroup: Vec::new() });
            }
            Form::Text(language) => *language,
        };
        let module: &Parsed = match &mut parsed {
            Some(parsed) => parsed,
            none => {
                let words = frozen(Flavour::Fast)?;
                none.insert(Parsed::new(bytemuck::cast_slice(&words), kernel.name).map_err(broken)?)
            }
        };
        let source = module.write(language).map_err(broken)?;
        let threadgroup = if language == Language::Msl { module.workgroup_memory() } else { Vec::new() };
        Ok(Written { contents: Contents::Text(source.text), entry: source.entry, threadgroup })
    };
    forms.iter().map(&mut written).collect()
}
