//! Techniques: what a frame of each preset takes, and its passes.

use restir_host::buffers::SceneBuffers;
use restir_host::render::{Render, Shows};
use restir_host::scene::Scene;

use super::bench::{Bench, Budget};
use super::pace::{Took, took};
use super::rows::Row;
use super::subjects::{MAIN, Subject, subjects};
use super::{Extent, Found, Part};
use crate::Error;
use crate::bench::estimator::per_sample;

/// Bytes of a mebibyte.
const MEBIBYTE: f64 = 1048576.0;

pub(super) fn measure(bench: &mut Bench) -> Result<Found, Error> {
    let mut found = Found::default();
    let budget = bench.budget();
    let mut left_out = Vec::new();
    for subject in subjects(bench.extent) {
        if budget.is_over() {
            left_out.push(subject.name());
        } else {
            found.rows.extend(of_subject(bench, &budget, &subject)?);
        }
    }
    found.leave_out(&left_out);
    if !bench.device().has_clock() {
        let what = "The adapter has no timestamp queries: times are of frames that are submitted together, and no pass is timed.";
        found.notes.push(what.to_owned());
    }
    Ok(found)
}

fn of_subject(bench: &mut Bench, budget: &Budget, subject: &Subject) -> Result<Vec<Row>, Error> {
    let (name, size, seconds) = (subject.name(), bench.size(), bench.figure_seconds());
    let scene = SceneBuffers::build(&Scene::load(subject.scene)?)?;
    let render = subject.render(size)?;
    let rays: f64 = per_sample(&scene, &render)?.values().map(|asked| asked.rays()).sum();
    let mega_rays = rays * f64::from(size[0]) * f64::from(size[1]) * 1.0e-6;
    let figure = |column: String, value| Row::new(Part::Frames, &name, column, value);
    let mut rows = vec![figure("rays a pixel".to_owned(), rays)];
    // to compile both flavours of all takes a software adapter too long
    let is_first = subject.name() == MAIN[0].name();
    let flavours = if bench.extent == Extent::Quick && !is_first { 1 } else { usize::MAX };
    for (flavour, gpu) in bench.executors().iter_mut().take(flavours).take_while(|_| !budget.is_over()) {
        let Took { milliseconds, kernels } = took(gpu, &scene, &render, seconds)?;
        rows.push(figure(format!("{flavour}, ms"), milliseconds));
        rows.push(figure(format!("{flavour}, Mrays/s"), 1.0e3 * mega_rays / milliseconds));
        let pass =
            |(kernel, time)| Row::new(Part::Passes, format!("{name}: `{kernel}`"), format!("{flavour}, ms"), time);
        rows.extend(kernels.into_iter().map(pass));
    }
    // of frames that go on
    let going = Render { count: 2, shows: Shows::Each, ..render };
    rows.push(figure("MiB of buffers".to_owned(), going.plan(&scene).bytes() as f64 / MEBIBYTE));
    Ok(rows)
}
