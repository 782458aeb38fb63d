//! Curves of a training run as SVG, one panel each.

use std::fmt::Write;

use crate::report::plot::{escape, svg_open};

const WIDTH_PX: f64 = 760.0;
const PANEL_PX: f64 = 130.0;
const LEFT_PX: f64 = 70.0;
const TOP_PX: f64 = 34.0;

/// A named row of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<'a> {
    /// What the numbers are.
    pub label: &'a str,
    /// One for each step; what is not finite is left out.
    pub values: Vec<f64>,
}

/// Picture of all curves, below each other; `axis` is what the steps are.
pub fn curves(title: &str, axis: &str, all: &[Curve<'_>]) -> String {
    let height = TOP_PX + all.len() as f64 * (PANEL_PX + 24.0) + 20.0;
    let mut svg = svg_open(WIDTH_PX, height, 12);
    let _ = write!(
        svg,
        r#"<text x="{LEFT_PX}" y="20" font-size="14">{}, by {}</text>"#,
        escape(title),
        escape(axis)
    );
    for (index, curve) in all.iter().enumerate() {
        panel(&mut svg, curve, TOP_PX + index as f64 * (PANEL_PX + 24.0));
    }
    svg.push_str("</svg>\n");
    svg
}

fn panel(svg: &mut String, curve: &Curve<'_>, top: f64) {
    let known = curve.values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let span = if high > low { high - low } else { 1.0 };
    let width = WIDTH_PX - LEFT_PX - 16.0;
    let _ = write!(
        svg,
        r##"<rect x="{LEFT_PX}" y="{:.1}" width="{width:.1}" height="{PANEL_PX}" fill="none" stroke="#bbb"/><text x="{LEFT_PX}" y="{:.1}">{}</text>"##,
        top + 14.0,
        top + 10.0,
        escape(curve.label)
    );
    if low > high {
        return;
    }
    let (upper, lower) = (top + 24.0, top + 14.0 + PANEL_PX);
    let _ = write!(
        svg,
        r#"<text x="{x:.1}" y="{upper:.1}" text-anchor="end">{high:.4}</text><text x="{x:.1}" y="{lower:.1}" text-anchor="end">{low:.4}</text>"#,
        x = LEFT_PX - 6.0
    );
    let last = curve.values.len().saturating_sub(1).max(1) as f64;
    let points: Vec<String> = (0..curve.values.len())
        .filter(|index| curve.values[*index].is_finite())
        .map(|index| {
            let x = LEFT_PX + width * index as f64 / last;
            let y = top + 14.0 + PANEL_PX * (1.0 - (curve.values[index] - low) / span);
            format!("{x:.1},{y:.1}")
        })
        .collect();
    let _ = write!(
        svg,
        r##"<polyline points="{}" fill="none" stroke="#1f77b4" stroke-width="1.5"/>"##,
        points.join(" ")
    );
}
