//! Plots as SVG: error against run time with the Pareto front, and bars of stages.

use std::path::Path;

use anyhow::{Context, anyhow};
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of every plot.
const SIZE_PX: (u32, u32) = (860, 460);
/// Width of the column that names the series.
const LEGEND_PX: i32 = 250;
const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(40, 40, 40);
const PALE: RGBColor = RGBColor(225, 225, 225);

/// Okabe and Ito's palette for colour-blind readers, without its yellow, which is too pale on white.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];

/// A method with one point a setting.
#[derive(Debug, Clone)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// (x, y) of each setting, in its order.
    pub points: Vec<(f64, f64)>,
}

/// Error against cost: low is good on both axes.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// What is compared.
    pub title: String,
    /// With its unit.
    pub x_label: String,
    /// With its unit.
    pub y_label: String,
    /// One for each method.
    pub series: Vec<Series>,
}

/// How a [`Scatter`] is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes {
    /// x grows by factors and begins near the smallest value, instead of at 0.
    pub log_x: bool,
    /// With the Pareto front.
    pub front: bool,
}

/// One bar for each label, in groups of one colour.
#[derive(Debug, Clone)]
pub struct Bars {
    /// What is compared.
    pub title: String,
    /// What the length of a bar means, with its unit.
    pub x_label: String,
    /// From the top: label, length, group.
    pub bars: Vec<(String, f64, String)>,
}

/// The points that no other point beats on both axes, by growing x.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<(f64, f64)> = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for point in sorted {
        if front.last().is_none_or(|last| point.1 < last.1) {
            front.push(point);
        }
    }
    front
}

/// Draws a scatter plot with its Pareto front.
pub fn draw_scatter(plot: &Scatter, path: &Path) -> anyhow::Result<()> {
    draw_curves(plot, Axes { log_x: false, front: true }, path)
}

/// Draws a scatter plot. Series of very many points are lines without marks.
pub fn draw_curves(plot: &Scatter, axes: Axes, path: &Path) -> anyhow::Result<()> {
    std::fs::write(path, curves_svg(plot, axes)?).with_context(|| path.display().to_string())
}

/// The same as text, for a page that holds its plots itself.
pub fn curves_svg(plot: &Scatter, axes: Axes) -> anyhow::Result<String> {
    let mut svg = String::new();
    scatter(plot, axes, SVGBackend::with_string(&mut svg, SIZE_PX))
        .map_err(|error| anyhow!("{}: {error}", plot.title))?;
    Ok(svg)
}

/// Draws horizontal bars.
pub fn draw_bars(plot: &Bars, path: &Path) -> anyhow::Result<()> {
    bars(plot, path).map_err(|error| anyhow!("{}: {error}", path.display()))
}

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn scatter(plot: &Scatter, axes: Axes, backend: SVGBackend<'_>) -> Outcome {
    let points: Vec<(f64, f64)> = plot.series.iter().flat_map(|series| series.points.iter().copied()).collect();
    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(SIZE_PX.0 as i32 - LEGEND_PX);
    let (x_end, y_end) = (axis_end(points.iter().map(|p| p.0)), axis_end(points.iter().map(|p| p.1)));
    let mut builder = ChartBuilder::on(&left);
    builder.caption(&plot.title, (FONT, 17, &INK)).margin(12).x_label_area_size(46).y_label_area_size(64);
    let smallest = points.iter().map(|point| point.0).filter(|x| *x > 0.0).fold(x_end, f64::min);
    if axes.log_x {
        let x_axis = (smallest / 1.3..x_end * 1.2).log_scale();
        draw_series(plot, axes, x_end, &left, builder.build_cartesian_2d(x_axis, 0.0..y_end)?)?;
    } else {
        draw_series(plot, axes, x_end, &left, builder.build_cartesian_2d(0.0..x_end, 0.0..y_end)?)?;
    }
    let names = plot.series.iter().map(|series| series.name.as_str());
    legend(&right, names, axes.front.then_some("Pareto front"))?;
    root.present()?;
    Ok(())
}

/// Points of a series beyond which it is drawn as a line alone.
const MAX_MARKS: usize = 40;

/// The grid, the front, and every series.
fn draw_series<X>(
    plot: &Scatter,
    axes: Axes,
    x_end: f64,
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    mut chart: ChartContext<'_, SVGBackend<'_>, Cartesian2d<X, plotters::coord::types::RangedCoordf64>>,
) -> Outcome
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .x_desc(&plot.x_label)
        .y_desc(&plot.y_label)
        .axis_desc_style((FONT, 14, &INK))
        .label_style((FONT, 12, &INK))
        .bold_line_style(PALE)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .x_label_formatter(&|value| short(*value))
        .y_label_formatter(&|value| short(*value))
        .draw()?;
    if axes.front {
        let points: Vec<(f64, f64)> = plot.series.iter().flat_map(|series| series.points.iter().copied()).collect();
        let stairs = stairs(&pareto_front(&points), x_end);
        chart.draw_series(std::iter::once(PathElement::new(stairs, INK.mix(0.5).stroke_width(1))))?;
    }
    for (index, series) in plot.series.iter().enumerate() {
        let colour = PALETTE[index % PALETTE.len()];
        chart.draw_series(std::iter::once(PathElement::new(series.points.clone(), colour.stroke_width(1))))?;
        for &point in series.points.iter().filter(|_| series.points.len() <= MAX_MARKS) {
            area.draw(&marker(index, chart.backend_coord(&point)))?;
        }
    }
    Ok(())
}

/// The front as steps: nothing known lies left of and below it.
fn stairs(front: &[(f64, f64)], x_end: f64) -> Vec<(f64, f64)> {
    let mut steps = Vec::new();
    for pair in front.windows(2) {
        steps.extend([pair[0], (pair[1].0, pair[0].1)]);
    }
    if let Some(&last) = front.last() {
        steps.extend([last, (x_end, last.1)]);
    }
    steps
}

/// A filled mark whose shape and colour follow the series, so that it reads without colour too.
fn marker<'b, DB: DrawingBackend + 'b>(index: usize, at: (i32, i32)) -> DynElement<'b, DB, (i32, i32)> {
    let style = PALETTE[index % PALETTE.len()].filled();
    let (x, y) = at;
    match index % 4 {
        0 => Circle::new(at, 5, style).into_dyn(),
        1 => Rectangle::new([(x - 5, y - 5), (x + 5, y + 5)], style).into_dyn(),
        2 => TriangleMarker::new(at, 6, style).into_dyn(),
        _ => Polygon::new([(x, y - 6), (x + 6, y), (x, y + 6), (x - 6, y)], style).into_dyn(),
    }
}

fn legend<'b, 'n, DB: DrawingBackend + 'b>(
    area: &DrawingArea<DB, plotters::coord::Shift>,
    names: impl Iterator<Item = &'n str>,
    front: Option<&str>,
) -> Result<(), Box<dyn std::error::Error>>
where
    DB::ErrorType: 'static,
{
    let text = (FONT, 13, &INK).into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = 52;
    for (index, name) in names.enumerate() {
        area.draw(&marker::<'b, DB>(index, (10, y)))?;
        for (line, part) in wrapped(name, 34).iter().enumerate() {
            area.draw(&Text::new(part.clone(), (24, y + 15 * line as i32), text.clone()))?;
        }
        y += 8 + 15 * wrapped(name, 34).len() as i32;
    }
    if let Some(front) = front {
        area.draw(&PathElement::new(vec![(2, y), (18, y)], INK.mix(0.5).stroke_width(1)))?;
        area.draw(&Text::new(front.to_owned(), (24, y), text))?;
    }
    Ok(())
}

fn bars(plot: &Bars, path: &Path) -> Outcome {
    let groups = plot.bars.iter().fold(Vec::<&str>::new(), |mut groups, (_, _, group)| {
        if !groups.contains(&group.as_str()) {
            groups.push(group);
        }
        groups
    });
    let height_px = 120 + 24 * plot.bars.len() as u32;
    let root = SVGBackend::new(path, (SIZE_PX.0, height_px)).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(SIZE_PX.0 as i32 - LEGEND_PX);
    let count = plot.bars.len() as f64;
    let x_end = axis_end(plot.bars.iter().map(|bar| bar.1)) * 1.12;
    let mut chart = ChartBuilder::on(&left)
        .caption(&plot.title, (FONT, 17, &INK))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(230)
        .build_cartesian_2d(0.0..x_end, 0.0..count.max(1.0))?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(0)
        .x_desc(&plot.x_label)
        .axis_desc_style((FONT, 14, &INK))
        .label_style((FONT, 12, &INK))
        .bold_line_style(PALE)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .x_label_formatter(&|value| short(*value))
        .draw()?;
    let before = (FONT, 12, &INK).into_text_style(&left).pos(Pos::new(HPos::Right, VPos::Center));
    let after = (FONT, 12, &INK).into_text_style(&left).pos(Pos::new(HPos::Left, VPos::Center));
    for (index, (label, length, group)) in plot.bars.iter().enumerate() {
        let middle = count - 0.5 - index as f64;
        let colour = PALETTE[groups.iter().position(|known| known == group).unwrap_or(0) % PALETTE.len()];
        let bar = Rectangle::new([(0.0, middle - 0.34), (*length, middle + 0.34)], colour.filled());
        chart.draw_series(std::iter::once(bar))?;
        let label = EmptyElement::at((0.0, middle)) + Text::new(label.clone(), (-6, 0), before.clone());
        chart.draw_series(std::iter::once(label))?;
        let value =
            EmptyElement::at((*length, middle)) + Text::new(super::table::number(*length), (5, 0), after.clone());
        chart.draw_series(std::iter::once(value))?;
    }
    legend(&right, groups.into_iter(), None)?;
    root.present()?;
    Ok(())
}

/// An end of an axis from 0 that leaves room beyond the largest value.
fn axis_end(values: impl Iterator<Item = f64>) -> f64 {
    let largest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
    if largest > 0.0 { largest * 1.08 } else { 1.0 }
}

/// An axis label: as many decimals as its size needs.
fn short(value: f64) -> String {
    let decimals = match value.abs() {
        size if size >= 10.0 || size == 0.0 => 0,
        size if size >= 1.0 => 1,
        size if size >= 0.1 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// Words on lines of at most `width` characters.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("starts with one line");
        if !last.is_empty() && last.len() + 1 + word.len() > width {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [(1.0, 5.0), (2.0, 6.0), (3.0, 2.0), (3.0, 3.0), (4.0, 2.0), (5.0, 1.0), (f64::NAN, 0.0)];
        assert_eq!(pareto_front(&points), [(1.0, 5.0), (3.0, 2.0), (5.0, 1.0)]);
        assert!(pareto_front(&[]).is_empty());
    }

    #[test]
    fn plots_name_their_axes_and_series() {
        let folder = crate::report::scratch_folder("plot");
        let path = folder.join("scatter.svg");
        let series = |name: &str, x| Series { name: name.into(), points: vec![(x, 2.0), (2.0 * x, 1.0)] };
        let plot = Scatter {
            title: "urban".into(),
            x_label: "surface pass, ms".into(),
            y_label: "holes, %".into(),
            series: vec![series("averaged", 1.0), series("own plane", 3.0)],
        };
        draw_scatter(&plot, &path).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        for text in ["urban", "surface pass, ms", "holes, %", "averaged", "own plane", "Pareto front"] {
            assert!(svg.contains(text), "{text}");
        }
        let path = folder.join("bars.svg");
        let bars =
            vec![("encode".to_owned(), 3.0, "server".to_owned()), ("decode".to_owned(), 1.0, "client".to_owned())];
        draw_bars(&Bars { title: "stages".into(), x_label: "ms".into(), bars }, &path).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().contains("decode"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
