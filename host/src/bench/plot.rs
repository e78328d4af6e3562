//! relMSE against time, both axes logarithmic, as SVG.

use std::ops::Range;

use plotters::prelude::*;

use super::SceneResult;

const SIZE: (u32, u32) = (720, 480);

/// The plot of a scene; without a single figure it is an empty frame that says so.
///
/// # Errors
/// What the plotter says.
pub(crate) fn svg(result: &SceneResult) -> Result<String, String> {
    let series: Vec<(&str, Vec<(f64, f64)>)> = result
        .series
        .iter()
        .map(|series| {
            let positive = |point: &(f64, f64)| point.0 > 0.0 && point.1 > 0.0;
            let points = series.error_over_time(&result.truth).into_iter().filter(positive).collect();
            (series.technique.name.as_str(), points)
        })
        .collect();
    let mut text = String::new();
    draw(&mut text, &result.scene, &series).map_err(|error| error.to_string())?;
    Ok(text)
}

fn draw(
    text: &mut String,
    scene: &str,
    series: &[(&str, Vec<(f64, f64)>)],
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let points = || series.iter().flat_map(|(_, points)| points);
    let title =
        if points().next().is_none() { format!("{scene}: {}", super::report::REFUSED) } else { scene.to_owned() };
    let x = decades(points().map(|point| point.0));
    let y = decades(points().map(|point| point.1));
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    let label = |value: &f64| format!("{value:e}");
    chart
        .configure_mesh()
        .x_desc("time, s")
        .y_desc("relMSE")
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    for (index, (name, points)) in series.iter().enumerate() {
        let color = Palette99::pick(index).to_rgba();
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color.stroke_width(2)));
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    area.present()
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
        let result = super::super::tests::furnace();
        let text = svg(&result).unwrap();
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
