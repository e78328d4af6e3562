//! Files of the kinds that users of comparable software reported: each comes out right.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::technique::path::PathSettings;
use restir_tests::gltf_motion::imported as import;
use restir_tests::reported::{self, Reported, Right};
use restir_tests::suite::{Trial, ensure};

const SIDE: u32 = 24;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials: Vec<Trial> = reported::files()
        .into_iter()
        .map(|file| Trial::test(file.name.clone(), move || comes_out_right(file)))
        .collect();
    trials.push(Trial::test("there are many", || ensure(reported::files().len() >= 30, || "too few".to_owned())));
    trials
}

fn comes_out_right(Reported { name: _, file, right }: Reported) -> Result<(), Failed> {
    let read = import("file", &file);
    let warnings = read.as_ref().map(|scene| scene.warnings.clone()).unwrap_or_default();
    match right {
        Right::Refusal(words) => {
            let problem = read.err().ok_or("it is read")?.message().unwrap_or_default().to_owned();
            ensure(problem.contains(&words), || format!("{words:?} is not in: {problem}"))
        }
        Right::Warning(words) => {
            read?;
            ensure(warnings.iter().any(|warning| warning.contains(&words)), || {
                format!("{words:?} is in none of {warnings:?}")
            })
        }
        Right::Silence => {
            read?;
            ensure(warnings.is_empty(), || format!("{warnings:?}"))
        }
        Right::Picture { same, wrong, within } => {
            read?;
            ensure(warnings.is_empty(), || format!("{warnings:?}"))?;
            let [own, same, wrong] = [file, same, wrong].map(|file| picture(&file));
            let (own, same, wrong) = (own?, same?, wrong?);
            let [error, fault] = [&same, &wrong].map(|other| difference(&own, other));
            println!("{error:.1e} from what is right, {fault:.1e} from what is wrong");
            ensure(error <= within, || format!("the picture differs by {error:e}, more than {within:e}"))?;
            // else the comparison would not see the fault
            ensure(fault > 4.0 * within, || format!("the fault differs by {fault:e} only"))
        }
    }
}

fn picture(file: &[u8]) -> Result<Vec<[f32; 3]>, Failed> {
    let scene = SceneBuffers::build(&import("file", file)?)?;
    let settings = PathSettings { max_depth: 4, ..PathSettings::default() };
    let render = Render { count: 8, ..Render::new([SIDE; 2], settings) };
    Ok(render.render(&scene, &mut CpuExecutor::new()?)?.image.pixels)
}

/// The mean of what two pictures differ by, relative to their mean.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let differences = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs()));
    differences.sum::<f64>() / b.iter().map(|b| f64::from(*b)).sum::<f64>()
}
