//! Whether a `fast` module reaches the other shading languages: naga parses, validates and translates it.

use std::error::Error;

use naga::ShaderStage;
use naga::back::pipeline_constants::process_overrides;
use naga::back::{PipelineConstants, glsl, hlsl, msl, wgsl};
use naga::front::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Findings as sentences: at most one a language.
pub fn check(bytes: &[u8], entry: &str) -> Vec<String> {
    unwritable(bytes, entry).unwrap_or_else(|finding| vec![finding])
}

fn rejects(step: &str, error: &(dyn Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |&error| error.source());
    let causes: Vec<String> = causes.map(ToString::to_string).collect();
    format!("naga rejects {step}: {}", causes.join(": "))
}

/// The languages into which the module cannot be written; the error is about the module itself.
fn unwritable(bytes: &[u8], entry: &str) -> Result<Vec<String>, String> {
    let module = spv::parse_u8_slice(bytes, &spv::Options::default()).map_err(|e| rejects("the module", &e))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).map_err(|e| rejects("its translation", e.as_inner()))?;
    let wgsl = wgsl::write_string(&module, &info, wgsl::WriterFlags::empty()).map(drop).map_err(|e| e.to_string());

    let stage = Some((ShaderStage::Compute, entry));
    let (module, info) = process_overrides(&module, &info, stage, &PipelineConstants::default())
        .map_err(|e| rejects("its specialization", &e))?;
    // Metal 2.4 is what wgpu asks for on current systems.
    let options = msl::Options { lang_version: (2, 4), ..Default::default() };
    let msl = msl::write_string(&module, &info, &options, &Default::default()).map(drop).map_err(|e| e.to_string());
    let (mut text, options, pipeline) = (String::new(), hlsl::Options::default(), hlsl::PipelineOptions::default());
    let mut writer = hlsl::Writer::new(&mut text, &options, &pipeline);
    let hlsl = writer.write(&module, &info, None).map(drop).map_err(|e| e.to_string());
    let (mut text, options) = (String::new(), glsl::Options::default());
    let pipeline =
        glsl::PipelineOptions { shader_stage: ShaderStage::Compute, entry_point: entry.to_owned(), multiview: None };
    let glsl = glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, Default::default())
        .and_then(|mut writer| writer.write())
        .map(drop)
        .map_err(|e| e.to_string());

    let results = [("WGSL", wgsl), ("MSL", msl), ("HLSL", hlsl), ("GLSL", glsl)];
    let unwritable = results.into_iter().filter_map(|(language, result)| Some((language, result.err()?)));
    Ok(unwritable.map(|(language, error)| format!("naga cannot write {language}: {error}")).collect())
}
