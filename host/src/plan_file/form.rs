//! What a kernel is written as.

use crate::exec::Flavour;
use crate::language::{Language, Parsed};
use crate::plan_file::Contents;
use crate::{Error, Shaders, spirv};
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
    pub const ALL: [Self; 5] = [
        Self::Spirv,
        Self::Text(Language::Wgsl),
        Self::Text(Language::Msl),
        Self::Text(Language::Hlsl),
        Self::Text(Language::Glsl),
    ];

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

/// A kernel with its constants frozen, in each of the forms, with the name of its entry point in it.
pub(super) fn write(kernel: &KernelDesc, constants: &[u32], forms: &[Form]) -> Result<Vec<(Contents, String)>, Error> {
    let broken = |source: String| Error::Module { kernel: kernel.name.to_owned(), source: source.into() };
    let frozen = |flavour| {
        let words = Shaders::Embedded.load(kernel.name, flavour)?;
        let values: Vec<(u32, u32)> = kernel.constants.iter().map(|c| c.id).zip(constants.iter().copied()).collect();
        spirv::freeze(&words, &values).ok_or_else(|| broken("it is no SPIR-V".to_owned()))
    };
    let is_text = |form: &Form| *form != Form::Spirv;
    let parse = || Parsed::new(bytemuck::cast_slice(&frozen(Flavour::Fast)?), kernel.name).map_err(broken);
    let parsed = if forms.iter().any(is_text) { Some(parse()?) } else { None };
    let written = |form: &Form| match (form, &parsed) {
        (Form::Text(language), Some(parsed)) => {
            let source = parsed.write(*language).map_err(broken)?;
            Ok((Contents::Text(source.text), source.entry))
        }
        _ => Ok((Contents::Words(frozen(Flavour::Exact)?.into()), kernel.name.to_owned())),
    };
    forms.iter().map(written).collect()
}
