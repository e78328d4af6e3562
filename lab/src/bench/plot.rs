//! Curves with logarithmic axes, as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{SceneResult, Series};

const SIZE: (u32, u32) = (720, 480);

/// Points that are joined.
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A chart of several lines. What is not positive has no place in it.
pub(crate) struct Panel {
    pub(crate) title: String,
    /// What is along x and along y.
    pub(crate) axes: [&'static str; 2],
    pub(crate) lines: Vec<Line>,
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The plot of a scene; without a single figure it is an empty frame that says so.
///
/// # Errors
/// What the plotter says.
pub(crate) fn svg(result: &SceneResult) -> Result<String, String> {
    let line = |series: &Series| Line {
        name: series.technique.name.clone(),
        points: series.error_over_time(&result.truth).into_iter().filter(is_positive).collect(),
    };
    let lines: Vec<Line> = result.series.iter().map(line).collect();
    let empty = lines.iter().all(|line| line.points.is_empty());
    let title = if empty { format!("{}: {}", result.scene, super::report::REFUSED) } else { result.scene.clone() };
    grid(&[Panel { title, axes: ["time, s", "relMSE"], lines }], 1, SIZE)
}

/// Panels of the given size, row by row.
///
/// # Errors
/// What the plotter says.
pub(crate) fn grid(panels: &[Panel], columns: usize, (width, height): (u32, u32)) -> Result<String, String> {
    let rows = panels.len().div_ceil(columns);
    let mut text = String::new();
    let draw = |text: &mut String| -> Drawn {
        let area = SVGBackend::with_string(text, (width * columns as u32, height * rows as u32)).into_drawing_area();
        area.fill(&WHITE)?;
        area.split_evenly((rows, columns)).iter().zip(panels).try_for_each(|(area, panel)| draw_panel(area, panel))?;
        area.present()
    };
    draw(&mut text).map_err(|error| error.to_string())?;
    Ok(text)
}

fn is_positive(point: &(f64, f64)) -> bool {
    point.0 > 0.0 && point.1 > 0.0
}

fn draw_panel(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel) -> Drawn {
    let points = || panel.lines.iter().flat_map(|line| &line.points).filter(|point| is_positive(point));
    let x = decades(points().map(|point| point.0));
    let y = decades(points().map(|point| point.1));
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    let label = |value: &f64| format!("{value:e}");
    chart
        .configure_mesh()
        .x_desc(panel.axes[0])
        .y_desc(panel.axes[1])
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    for (index, line) in panel.lines.iter().enumerate() {
        let color = Palette99::pick(index).to_rgba();
        let points = || line.points.iter().copied().filter(is_positive);
        chart
            .draw_series(LineSeries::new(points(), color.stroke_width(2)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color.stroke_width(2)));
        chart.draw_series(points().map(|point| Circle::new(point, 3, color.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()
}

/// The decades around positive values; one around 1 without any.
fn decades(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (lo, hi) = values.fold((f64::INFINITY, 0.0), |(lo, hi): (f64, f64), value| (lo.min(value), hi.max(value)));
    if lo > hi {
        return 1.0..10.0;
    }
    let (lo, hi) = (lo.log10().floor(), hi.log10().ceil());
    10_f64.powf(lo)..10_f64.powf(if hi > lo { hi } else { lo + 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_has_a_point_a_figure_and_names_the_techniques() {
        let text = svg(&super::super::tests::furnace()).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        assert_eq!(text.matches("<circle").count(), 10);
        for word in ["furnace", "relMSE", "time, s", "path:roulette=on"] {
            assert!(text.contains(word), "{word}");
        }
    }

    #[test]
    fn a_plot_without_figures_says_so() {
        let mut result = super::super::tests::furnace();
        result.truth.relative_noise = 1.0;
        let text = svg(&result).unwrap();
        assert!(text.contains(super::super::report::REFUSED) && !text.contains("<circle"));
    }

    #[test]
    fn ranges_are_whole_decades() {
        assert_eq!(decades([0.02, 0.3].into_iter()), 0.01..1.0);
        assert_eq!(decades([1.0].into_iter()), 1.0..10.0);
        assert_eq!(decades([].into_iter()), 1.0..10.0);
    }
}
