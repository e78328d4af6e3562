//! The report in Markdown.

use super::{BASELINES, FRAMES, Options, Row, View};
use restir_cli::trial::{Estimate, median};

/// A row in a line, for who waits.
pub(super) fn line(row: &Row) -> String {
    let ratios: Vec<String> = row.ratios().iter().map(ratio).collect();
    let path = ratio(&row.judged[0].over(row.baseline()));
    format!("{} {:?} {}: path {path}, {}", row.scene, row.view, row.width, ratios.join(", "))
}

pub(super) fn markdown(options: &Options, rows: &[Row]) -> String {
    let of_width = |&width| [View::Still, View::Orbit].map(|view| (view, width));
    let sections: String = options.width.iter().flat_map(of_width).map(|at| section(rows, at)).collect();
    format!("{}{sections}", heading(options))
}

fn heading(options: &Options) -> String {
    format!(
        "# Where reuse pays\n\n\
         relMSE of what {FRAMES} frames show over that of the better of two techniques without reuse in the time of all \
         {FRAMES} frames: path tracing of two segments, and resampling of 32 candidates from lights (RIS-32). Below 1 \
         reuse pays. The settings are those that `restir advise` tries. Where they begin with `last`, the last frame is judged, \
         which has the history of the others. Otherwise frames are independent and their mean is judged (`--accumulate`): \
         only a view that stands still has one, and of a scene that moves it is that of its last moment, as it is without \
         reuse. *best* is the least of them, the setting that `restir advise` names.\n\n\
         The halls are made by a generator (`restir scenes`, `host/src/scene/builtin/hall.rs`): hall-N is that \
         of the seed N, and no other seeds were tried. They have 60 to 959 lights: bulbs, panels, points and spots of seven \
         octaves of power, up to a quarter of them behind a wall, over diffuse, plastic (roughness 0.08 to 0.6) and metal \
         (0.1 to 0.5) surfaces. Emitters are emissive triangles and lights without a surface; few objects may have many of \
         them: `moving` has 5 lights, `toys` 2, and `foliage` a sky, a sun and a lantern. There a path that samples a light and \
         a direction knows nearly all that can be known of the light, so that one sample a pixel, which is what the last frame \
         has after all history, is less than many.\n\n\
         Rendered on the CPU, rays through the centres of pixels on both sides, all with spread samples; errors are \
         variances over {} independent chains (`restir_cli::trial`), ± is a standard error, times are medians of processor \
         time over images made in turns. In *orbit* the camera turns about its target by a degree a frame, \
         and all show what the last frame does. Made by `cargo lab reuse --write`.\n\n\
         The size of the image matters: the neighbours whose samples a pixel is shaded by are some pixels away, and the fewer \
         pixels there are, the more do the lights that matter, and their shadows, differ there. What differs stays as noise \
         however long the history is. In an orbit a pixel's own history differs in the same way, as it is of points that lie up to \
         half a pixel from what the pixel sees now; [docs/restir-di.md](restir-di.md#what-is-published-and-what-differs) has orbits at \
         768 x 576 beside.\n\n\
         What limits it, of the last frame: *empty* pixels found nothing of use among their own candidates, *copies* hold the \
         sample of the pixel to the right or below, *young* have less than half of the confidence that the frames or the cap \
         allow (of independent frames none; more rounds of candidates, which glossy surfaces have in an orbit, count as confidence), *refused* neighbours within the radius of shading are of another surface. Shares \
         of time are those of initial \
         candidates, of combining and of shading.\n",
        options.images,
    )
}

/// The rows of a view at a size, if there are any.
fn section(rows: &[Row], (view, width): (View, u32)) -> String {
    let rows: Vec<&Row> = rows.iter().filter(|row| (row.view, row.width) == (view, width)).collect();
    if rows.is_empty() {
        return String::new();
    }
    let settings = &rows[0].names;
    let names: String = settings.iter().map(|name| format!(" `{name}` |")).collect();
    let rule = "---:|".repeat(settings.len());
    let title = format!("{view:?}, {width} x {}", width * 3 / 4);
    format!(
        "\n## {title}\n\n| scene | emitters | path | RIS-32 |{names} best |\n|---|---:|---:|---:|{rule}---:|\n{}{}\n\
         | scene | setting | empty | copies | young | refused | initial | combine | shading |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|\n{}",
        rows.iter().map(|row| errors(row)).collect::<String>(),
        medians(&rows),
        rows.iter().map(|row| limits(row)).collect::<String>(),
    )
}

fn ratio(Estimate { value, error }: &Estimate) -> String {
    format!("{value:.2} ± {error:.2}")
}

fn errors(row: &Row) -> String {
    let baselines = row.judged[..BASELINES].iter().map(|judged| judged.over(row.baseline()));
    let cells: String = baselines.chain(row.ratios()).map(|over| format!(" {} |", ratio(&over))).collect();
    format!("| {} | {} |{cells} {:.2} |\n", row.scene, row.emitters, best(row))
}

fn best(row: &Row) -> f64 {
    row.ratios().iter().map(|ratio| ratio.value).fold(f64::INFINITY, f64::min)
}

/// Over the scenes, setting by setting.
fn medians(rows: &[&Row]) -> String {
    let of_setting = |i: usize| median(&rows.iter().map(|row| row.ratios()[i].value).collect::<Vec<_>>());
    let cells: String = (0..rows[0].names.len()).map(|i| format!(" {:.2} |", of_setting(i))).collect();
    let best = median(&rows.iter().map(|row| best(row)).collect::<Vec<_>>());
    format!("| median | | | |{cells} {best:.2} |\n")
}

fn limits(row: &Row) -> String {
    let line = |(name, limits): (&String, &Option<super::Limits>)| {
        let limits = (*limits)?;
        let shares = [limits.empty, limits.copies, limits.young, limits.refused].into_iter().chain(limits.time);
        let cells: String = shares.map(|share| format!(" {:.0} % |", 100.0 * share)).collect();
        Some(format!("| {} | `{name}` |{cells}\n", row.scene))
    };
    row.names.iter().zip(&row.limits).filter_map(line).collect()
}
