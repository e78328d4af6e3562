//! The report in Markdown.

use std::fmt::Write as _;

use restir_cli::trial::Estimate;

use super::{
    Cost, FRAMES, Options, Part, Row, SAMPLES, SETTLED, Study, TRUE_SAMPLES, View, correlated, moving, uncovered,
};
use crate::flip::PIXELS_PER_DEGREE;

pub(super) fn markdown(options: &Options, study: &Study, views: &[View], moving: &[moving::Row]) -> String {
    let mut text = heading(options, study);
    views.iter().for_each(|view| text += &section(view));
    let text = if study.moving { text + "\n" + &where_things_move(moving) } else { text };
    let text = if study.correlated.is_empty() { text } else { text + &correlations(views) };
    if study.uncovered.is_empty() { text } else { text + &what_comes_into_view(views) }
}

/// One setting beside the other; path tracing has no part in it.
pub(super) fn where_things_move(rows: &[moving::Row]) -> String {
    let mut text = format!(
        "## Where things move\n\nThe last of {FRAMES} frames of the built-in scene `moving`, in which lights, a board and a ball move, and of the same in which a \
         frame takes the time of four (`moving-fast`). `changed` says what becomes of paths that keep what arrives at their vertex k. \
         relMSE has the squared bias of what is biased. Made alone by `cargo lab gains --moving`.\n\n\
         | scene | settings | relMSE | ms a frame | relMSE times ms |\n|---|---|---:|---:|---:|\n"
    );
    for moving::Row { scene, settings, rel_mse, seconds } in rows {
        let ms = 1e3 * seconds;
        let [error, product] = [measured(rel_mse), format!("{:.3}", rel_mse.value * ms)];
        let _ = writeln!(text, "| {scene} | {} | {error} | {ms:.2} | {product} |", named(settings));
    }
    text
}

fn heading(options: &Options, study: &Study) -> String {
    let Options { images, width, .. } = options;
    let (Study { title, path, .. }, technique) = (study, study.technique());
    let only = match options {
        Options { subsurface: true, .. } => "--subsurface ",
        Options { suffixes: true, .. } => "--suffixes ",
        _ => "",
    };
    format!(
        "# What {title} gains\n\n\
         relMSE of {title} over that of path tracing which costs as much, once in time and once in rays: below 1 it pays. relMSE is the \
         mean of `(x - r)² / (r² + 0.01 m²)` over the channels of all pixels, r being the truth and m its mean. Of *the last frame* of {FRAMES} \
         a single frame is paid for, since a session has had the others anyway; of *the mean of {FRAMES} frames* all of them. \
         Errors are variances over {images} independent renders of {width} x {} pixels (`restir_cli::trial`), ± is a standard error. Time is \
         what one thread has had of the processor for a frame after the first {SETTLED}, so that it hardly depends on what else the machine does, and ± leaves its error out; rays \
         are those that a pixel's kernels ask for in a frame. Path tracing has the same \
         longest path, and the settings `{path}`; it was rendered with {SAMPLES:?} samples: in between its error is taken to follow a power \
         of their number. FLIP (Andersson et al. 2020) tells how different a picture looks from one of {TRUE_SAMPLES} samples, from 0 to 1, as pictures \
         are shown by ACES' curve, {PIXELS_PER_DEGREE} pixels a degree: the mean over pixels and renders.\n\nMade by `cargo lab gains {only}--write`. What settings mean is printed by `restir settings {technique}`.\n",
        width * 3 / 4,
    )
}

fn section(view: &View) -> String {
    let head = "| relMSE | FLIP | ms a frame | rays a pixel | over path tracing in equal time | with equal rays |";
    let rule = "|---|---:|---:|---:|---:|---:|---:|";
    let errors: Vec<String> =
        SAMPLES.iter().zip(&view.path).map(|(count, of)| format!("{} with {count}", measured(of))).collect();
    let looks: Vec<String> = view.path_flip.iter().map(|flip| format!("{flip:.3}")).collect();
    let Cost { seconds, rays } = view.sample;
    let mut text = format!(
        "\n## {}\n\nA sample of path tracing takes {:.2} ms and {rays:.2} rays a pixel. Its relMSE is {}; its FLIP {}.\n",
        view.name,
        1e3 * seconds,
        errors.join(", "),
        looks.join(", ")
    );
    for (title, frames) in [("the last frame".to_owned(), 1), (format!("the mean of {FRAMES} frames"), FRAMES)] {
        let rows: Vec<_> = view.rows.iter().filter(|row| row.frames == frames).collect();
        if !rows.is_empty() {
            let _ = write!(text, "\n| {title} {head}\n{rule}\n");
        }
        rows.into_iter().for_each(|row| text += &line(view, row));
    }
    text + &where_noise_is(&view.parts)
}

/// What each part has of the variance.
fn where_noise_is(parts: &[Part]) -> String {
    if parts.is_empty() {
        return String::new();
    }
    let mut text = "\nWhere the noise is, if single scattering is traced: the mean variance of a pixel's value, of one sample of path tracing, and of the last frame.\n\n\
                    | part | variance |\n|---|---:|\n"
        .to_owned();
    for Part { name, variance } in parts {
        let _ =
            writeln!(text, "| {name} | {:.2e} ± {:.0} % |", variance.value, 100.0 * variance.error / variance.value);
    }
    text
}

fn line(view: &View, row: &Row) -> String {
    let Cost { seconds, rays } = row.cost;
    let [time, of_rays] = [|cost: &Cost| cost.seconds, |cost: &Cost| cost.rays]
        .map(|of: fn(&Cost) -> f64| ratio(&view.over_path_tracing(row, of)));
    format!(
        "| {} | {} | {:.3} | {:.2} | {rays:.2} | {time} | {of_rays} |\n",
        named(row.settings),
        measured(&row.rel_mse),
        row.flip,
        1e3 * seconds
    )
}

fn named(settings: &str) -> String {
    if settings.is_empty() { "the defaults".to_owned() } else { format!("`{settings}`") }
}

/// Of three digits.
fn measured(Estimate { value, error }: &Estimate) -> String {
    let digits = (2 - value.log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$} ± {:.0} %", 100.0 * error / value)
}

fn ratio(Estimate { value, error }: &Estimate) -> String {
    format!("{value:.3} ± {error:.3}")
}

fn correlations(views: &[View]) -> String {
    let mut text = format!(
        "\n## What errors have in common\n\n\
         By `restir_lab::correlation`, of {FRAMES} frames after as many, each error limited to three times the root of what relMSE divides by, means \
         of three chains. *Neighbours* is the largest correlation of a pixel's error with that of a pixel up to 8 columns and rows away: \
         grain that the eye sees. *Next frame* is that with its own error a frame later. VIF is the variance of the mean of {FRAMES} frames over \
         that of the mean of as many independent ones. *Copies* is the share of the paths of the 16th frame that more than one pixel holds.\n\n\
         | scene | settings | neighbours | next frame | VIF | copies |\n|---|---|---:|---:|---:|---:|\n"
    );
    for (view, of) in views.iter().flat_map(|view| view.correlated.iter().map(move |of| (view, of))) {
        let settings = described(of.settings);
        let copied = of.copied.map_or_else(String::new, |copied| format!("{:.0} %", 100.0 * copied));
        let _ = writeln!(
            text,
            "| {} | {settings} | {:.3} | {:.3} | {:.1} | {copied} |",
            view.name, of.over_pixels, of.over_time, of.inflation
        );
    }
    text
}

fn what_comes_into_view(views: &[View]) -> String {
    let mut text = format!(
        "\n## What comes into view\n\n\
         The last of {FRAMES} frames of a pan of {} pixels a frame, of {} x {} pixels: mean squared errors, limited as above, of surfaces that the \
         frame before did not see, most of them at one edge of the picture, and of all others. Some surfaces are harder to render than others for any \
         technique, so the last column is what counts: the quotient over that of path tracing. `preset=mmis` has no history at all.\n\n\
         | scene | settings | new | others | quotient | over path tracing's |\n|---|---|---:|---:|---:|---:|\n",
        uncovered::STEP,
        uncovered::SIZE[0],
        uncovered::SIZE[1],
    );
    for view in views {
        for of in &view.uncovered {
            let settings = described(of.settings);
            let over = of.ratio() / view.uncovered[0].ratio();
            let _ = writeln!(
                text,
                "| {} | {settings} | {:.4} | {:.4} | {:.2} | {over:.2} |",
                view.name,
                of.new,
                of.seen,
                of.ratio()
            );
        }
    }
    text
}

/// A technique and its settings; nothing of path tracing.
fn described(settings: Option<(&str, &str)>) -> String {
    match settings {
        None => format!("path tracing, {} samples", correlated::SAMPLES),
        Some((technique, settings)) => format!("{technique}, {}", named(settings)),
    }
}
