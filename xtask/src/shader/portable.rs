//! Whether a `fast` module reaches the other shading languages: naga parses, validates and translates it.

use std::fmt::Display;

use naga::back::pipeline_constants::process_overrides;
use naga::back::{PipelineConstants, glsl, hlsl, msl, wgsl};
use naga::front::spv;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ShaderStage};

/// Findings as sentences: at most one a language.
pub fn check(bytes: &[u8], entry: &str) -> Vec<String> {
    let (module, info) = match parse(bytes) {
        Ok(parsed) => parsed,
        Err(finding) => return vec![finding],
    };
    let (frozen, frozen_info) =
        match process_overrides(&module, &info, Some((ShaderStage::Compute, entry)), &PipelineConstants::default()) {
            Ok(processed) => processed,
            Err(error) => return vec![rejects("its specialization", &error)],
        };
    let results = [
        to_wgsl(&module, &info),
        to_msl(&frozen, &frozen_info),
        to_hlsl(&frozen, &frozen_info),
        to_glsl(&frozen, &frozen_info, entry),
    ];
    results.into_iter().filter_map(Result::err).collect()
}

fn rejects(step: &str, error: &dyn std::error::Error) -> String {
    let mut text = format!("naga rejects {step}: {error}");
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}

fn unwritable(language: &str) -> impl Fn(&dyn Display) -> String {
    move |error| format!("naga cannot write {language}: {error}")
}

fn parse(bytes: &[u8]) -> Result<(Module, ModuleInfo), String> {
    let module = spv::parse_u8_slice(bytes, &spv::Options::default()).map_err(|e| rejects("the module", &e))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|e| rejects("its translation", &e.into_inner()))?;
    Ok((module, info))
}

fn to_wgsl(module: &Module, info: &ModuleInfo) -> Result<(), String> {
    wgsl::write_string(module, info, wgsl::WriterFlags::empty()).map(drop).map_err(|e| unwritable("WGSL")(&e))
}

fn to_msl(module: &Module, info: &ModuleInfo) -> Result<(), String> {
    // Metal 2.4 is what wgpu asks for on current systems.
    let options = msl::Options { lang_version: (2, 4), ..Default::default() };
    msl::write_string(module, info, &options, &msl::PipelineOptions::default())
        .map(drop)
        .map_err(|e| unwritable("MSL")(&e))
}

fn to_hlsl(module: &Module, info: &ModuleInfo) -> Result<(), String> {
    let mut text = String::new();
    hlsl::Writer::new(&mut text, &hlsl::Options::default(), &hlsl::PipelineOptions::default())
        .write(module, info, None)
        .map(drop)
        .map_err(|e| unwritable("HLSL")(&e))
}

fn to_glsl(module: &Module, info: &ModuleInfo, entry: &str) -> Result<(), String> {
    let mut text = String::new();
    let pipeline =
        glsl::PipelineOptions { shader_stage: ShaderStage::Compute, entry_point: entry.to_owned(), multiview: None };
    glsl::Writer::new(&mut text, module, info, &glsl::Options::default(), &pipeline, Default::default())
        .and_then(|mut writer| writer.write())
        .map(drop)
        .map_err(|e| unwritable("GLSL")(&e))
}
