//! The features that `path` can be specialised to, and what is left of its module then.

use crate::fingerprint;
use restir_host::exec::Flavour;
use restir_host::plan::Pass;
use restir_host::{Shaders, spirv};
use restir_kernels::path::path;
use restir_shared::bsdf::markers;
use restir_shared::layout::{
    FEATURE_ALPHA, FEATURE_BLEND, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_EMISSIVE, FEATURE_ENVIRONMENT,
    FEATURE_FINE_TEXELS, FEATURE_GLOSSY, FEATURE_LIGHT_TABLE, FEATURE_MULTISCATTER, FEATURE_PUNCTUAL,
    FEATURE_SECOND_UVS, FEATURE_SHADING, FEATURE_SPECULAR, FEATURE_TEXTURES, FEATURE_TRANSMISSION, FEATURE_VOLUME,
};
use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op};
use std::collections::HashSet;
use std::io::Write;
use std::process::{Command, Stdio};

/// What a feature adds to the module.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its `FEATURE_` bit.
    pub feature: u32,
    /// For messages.
    pub name: &'static str,
    /// A number that only its code has; without one, the code only chooses among integers.
    pub marker: Option<f32>,
}

const fn part(feature: u32, name: &'static str, marker: Option<f32>) -> Part {
    Part { feature, name, marker }
}

/// Every feature that `path` has code of: light inside of bodies has kernels of its own. Markers of other parts than BSDFs are numbers that their code needs anyway.
pub const PARTS: [Part; 17] = [
    part(FEATURE_LIGHT_TABLE, "light table", None),
    part(FEATURE_EMISSIVE, "emissive", None),
    part(FEATURE_PUNCTUAL, "punctual", None),
    // one over 2 pi^2, the area of a map
    part(FEATURE_ENVIRONMENT, "environment", Some(0.050_660_59)),
    // one step of 8 bits
    part(FEATURE_TEXTURES, "textures", Some(1.0 / 255.0)),
    // the least squared length of an interpolated normal
    part(FEATURE_SHADING, "shading", Some(1.0e-12)),
    part(FEATURE_GLOSSY, "glossy", Some(markers::GLOSSY)),
    part(FEATURE_DELTA, "delta", Some(markers::DELTA)),
    part(FEATURE_TRANSMISSION, "transmission", Some(markers::TRANSMISSION)),
    part(FEATURE_DIFFUSE_TRANSMISSION, "diffuse transmission", Some(markers::DIFFUSE_TRANSMISSION)),
    // the first step of exp's argument reduction in the flavour exact; absorption is the only exponential
    part(FEATURE_VOLUME, "volume", Some(std::f32::consts::LOG2_E)),
    part(FEATURE_MULTISCATTER, "multiscatter", Some(markers::MULTISCATTER)),
    part(FEATURE_SPECULAR, "specular", Some(markers::SPECULAR)),
    part(FEATURE_ALPHA, "alpha", None),
    part(FEATURE_BLEND, "blend", None),
    part(FEATURE_SECOND_UVS, "second UVs", None),
    // one step of 16 bits
    part(FEATURE_FINE_TEXELS, "fine texels", Some(1.0 / 65_535.0)),
];

/// The module of `path`, specialised to `features` and optimised.
///
/// # Errors
/// A sentence, if the module or `spirv-opt` is missing or broken.
pub fn specialised(flavour: Flavour, features: u32) -> Result<Vec<u32>, String> {
    let words = Shaders::Embedded.load(path::DESC.name, flavour).map_err(|e| e.to_string())?;
    specialised_of(&words, features)
}

/// The same of a module with the interface of `path`, in place of the embedded one.
///
/// # Errors
/// A sentence, if `spirv-opt` is missing or the module broken.
pub fn specialised_of(words: &[u32], features: u32) -> Result<Vec<u32>, String> {
    let frozen = spirv::freeze(words, &[(path::DESC.constants[0].id, features)]);
    optimise(&frozen.ok_or_else(|| "not a SPIR-V module".to_owned())?)
}

/// Instructions of the module of a pass, flavour exact, frozen to the pass's constants and optimised: `settings` are what they say, where a driver only knows
/// that they are no more.
///
/// # Errors
/// A sentence, if the module or `spirv-opt` is missing or broken.
pub fn operations(pass: &Pass) -> Result<usize, String> {
    let words = Shaders::Embedded.load(pass.kernel.name, Flavour::Exact).map_err(|e| e.to_string())?;
    let mut module = rspirv::dr::load_words(&words).map_err(|state| format!("not a SPIR-V module: {state}"))?;
    if let Some(settings) = pass.kernel.constants.iter().find(|constant| constant.name == "settings") {
        fix(&mut module, settings.id);
    }
    let ids = pass.kernel.constants.iter().map(|constant| constant.id);
    let values: Vec<(u32, u32)> = ids.zip(pass.constants.iter().copied()).collect();
    let frozen = spirv::freeze(&module.assemble(), &values).ok_or_else(|| "not a SPIR-V module".to_owned())?;
    Ok(Content::of(&optimise(&frozen)?)?.operations)
}

/// Puts a specialization constant in the place of what it masks.
fn fix(module: &mut Module, spec_id: u32) {
    let decoration = [Operand::Decoration(Decoration::SpecId), Operand::LiteralBit32(spec_id)];
    let constant = module.annotations.iter().find(|i| i.operands.ends_with(&decoration)).map(|i| i.operands[0].clone());
    let Some(Operand::IdRef(constant)) = constant else { return };
    for instruction in module.all_inst_iter_mut().filter(|i| i.class.opcode == Op::BitwiseAnd) {
        if instruction.operands.contains(&Operand::IdRef(constant)) {
            let (ty, result) = (instruction.result_type, instruction.result_id);
            *instruction = Instruction::new(Op::CopyObject, ty, result, vec![Operand::IdRef(constant)]);
        }
    }
}

/// Whether `spirv-opt` can be started.
pub fn has_optimiser() -> bool {
    Command::new("spirv-opt").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
}

/// The BLAKE3 hash of what is left of `path`, specialised to `features` and optimised, see [`fingerprint::exact`].
///
/// # Errors
/// A sentence, if the module or `spirv-opt` is missing or broken.
pub fn hash(flavour: Flavour, features: u32) -> Result<String, String> {
    fingerprint::exact(&specialised(flavour, features)?)
}

fn optimise(words: &[u32]) -> Result<Vec<u32>, String> {
    let failed = |e: std::io::Error| format!("cannot run spirv-opt ({e}): install SPIRV-Tools");
    let mut command = Command::new("spirv-opt");
    // Only the second round drops the components of vectors that nothing but an absent feature reads.
    command.args(["--target-env=vulkan1.2", "-O", "-O", "--strip-debug", "-", "-o", "-"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().map_err(failed)?;
    // it reads everything before it writes anything
    let written = child.stdin.take().map_or(Ok(()), |mut input| input.write_all(bytemuck::cast_slice(words)));
    let output = child.wait_with_output().map_err(failed)?;
    if output.status.success() && written.is_ok() {
        Ok(bytemuck::pod_collect_to_vec(&output.stdout))
    } else {
        Err(format!("spirv-opt ended with {}", output.status))
    }
}

/// What counts in a module.
pub struct Content {
    /// Instructions inside functions, without labels.
    pub operations: usize,
    /// The bits of its 32-bit constants.
    pub constants: HashSet<u32>,
}

impl Content {
    /// # Errors
    /// A sentence, if the words are no SPIR-V.
    pub fn of(words: &[u32]) -> Result<Self, String> {
        let module = rspirv::dr::load_words(words).map_err(|state| format!("not a SPIR-V module: {state}"))?;
        let blocks = module.functions.iter().flat_map(|f| &f.blocks);
        let constants = module.types_global_values.iter().filter_map(|i| match i.operands[..] {
            [Operand::LiteralBit32(bits)] if i.class.opcode == Op::Constant => Some(bits),
            _ => None,
        });
        Ok(Self { operations: blocks.map(|b| b.instructions.len()).sum(), constants: constants.collect() })
    }

    /// The features whose markers it has.
    pub fn marked(&self) -> u32 {
        let has = |part: &&Part| part.marker.is_some_and(|marker| self.constants.contains(&marker.to_bits()));
        PARTS.iter().filter(has).fold(0, |features, part| features | part.feature)
    }
}

/// The features that have markers.
pub fn with_markers() -> u32 {
    PARTS.iter().filter(|part| part.marker.is_some()).fold(0, |features, part| features | part.feature)
}

/// The names of features, for messages.
pub fn names(features: u32) -> String {
    let set = PARTS.iter().filter(|part| part.feature & features != 0).map(|part| part.name);
    set.collect::<Vec<_>>().join(", ")
}
