//! Lying bars as SVG: some stacked parts per row, with marks and a reference.

use std::fmt::Write;

use crate::report::plot::{escape, svg_open};

const LABEL_PX: f64 = 250.0;
const BAR_PX: f64 = 460.0;
const NUMBER_PX: f64 = 190.0;
const ROW_PX: f64 = 24.0;
const TOP_PX: f64 = 52.0;
/// Colours of the parts.
const COLOURS: [&str; 5] = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#aaaaaa"];

/// One bar.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bar {
    /// Text on the left.
    pub label: String,
    /// Lengths of the parts, one for each part of the picture.
    pub values: Vec<f64>,
    /// Dots on the same scale.
    pub dots: Vec<f64>,
    /// Text on the right.
    pub said: String,
}

/// A picture of bars whose parts have these names; `full` is the longest length that there can be,
/// if there is one.
pub fn bars(title: &str, parts: &[&str], rows: &[Bar], full: Option<f64>) -> String {
    let length = |row: &Bar| row.values.iter().filter(|v| v.is_finite()).sum::<f64>();
    let dots = rows.iter().flat_map(|row| &row.dots).copied().filter(|dot| dot.is_finite());
    let longest = rows.iter().map(length).chain(dots).fold(0.0, f64::max);
    let longest = full.unwrap_or(longest);
    let px = BAR_PX / if longest > 0.0 { longest } else { 1.0 };
    let (width, height) =
        (LABEL_PX + BAR_PX + NUMBER_PX, TOP_PX + ROW_PX * rows.len() as f64 + 8.0);
    let mut svg = svg_open(width, height, 13);
    let _ = write!(svg, r#"<text x="8" y="18" font-weight="bold">{}</text>"#, escape(title));
    legend(&mut svg, parts);
    for (index, row) in rows.iter().enumerate() {
        draw(&mut svg, row, TOP_PX + ROW_PX * index as f64, px);
    }
    svg.push_str("</svg>\n");
    svg
}

fn legend(svg: &mut String, parts: &[&str]) {
    let mut x = LABEL_PX;
    for (part, colour) in parts.iter().zip(COLOURS) {
        let _ = write!(
            svg,
            r#"<rect x="{x:.0}" y="28" width="12" height="12" fill="{colour}"/><text x="{:.0}" y="38">{}</text>"#,
            x + 17.0,
            escape(part)
        );
        x += 34.0 + 7.5 * part.chars().count() as f64;
    }
}

fn draw(svg: &mut String, row: &Bar, top: f64, px: f64) {
    let _ = write!(
        svg,
        r#"<text x="{:.0}" y="{:.0}" text-anchor="end">{}</text>"#,
        LABEL_PX - 8.0,
        top + 15.0,
        escape(&row.label)
    );
    let mut x = LABEL_PX;
    for (value, colour) in row.values.iter().zip(COLOURS) {
        let width = if value.is_finite() { (value * px).clamp(0.0, BAR_PX) } else { 0.0 };
        if width > 0.0 {
            let _ = write!(
                svg,
                r#"<rect x="{x:.1}" y="{:.0}" width="{width:.1}" height="16" fill="{colour}"/>"#,
                top + 3.0
            );
        }
        x += width;
    }
    for dot in row.dots.iter().filter(|dot| dot.is_finite()) {
        let at = (LABEL_PX + dot * px).clamp(LABEL_PX, LABEL_PX + BAR_PX);
        let _ = write!(
            svg,
            r##"<circle cx="{at:.1}" cy="{:.0}" r="4" fill="#ffffff" stroke="#222222" stroke-width="1.5"/>"##,
            top + 11.0
        );
        x = x.max(at + 4.0);
    }
    let _ = write!(
        svg,
        r#"<text x="{:.1}" y="{:.0}">{}</text>"#,
        x + 6.0,
        top + 15.0,
        escape(&row.said)
    );
}

#[cfg(test)]
#[path = "bars_tests.rs"]
mod tests;
