//! A study as small plots, one for each axis: success with its interval, energy and chip time.

use std::fmt::Write;

use crate::report::plot::{escape, svg_open};
use crate::report::study::{AxisRows, COST_TABLES, OnChip, StudyTable};

/// Panels beside each other, their size and what is around the plot inside, pixels.
const COLUMNS: usize = 3;
const PANEL_PX: [f64; 2] = [330.0, 220.0];
const LEFT_PX: f64 = 44.0;
const RIGHT_PX: f64 = 48.0;
const ABOVE_PX: f64 = 34.0;
const BELOW_PX: f64 = 28.0;
const TOP_PX: f64 = 52.0;

const SUCCESS_COLOUR: &str = "#1f77b4";
const ENERGY_COLOUR: &str = "#d62728";
const TIME_COLOUR: &str = "#2c8a2c";

/// Energies and times are those of this table.
const COST_TABLE: &str = COST_TABLES[0];

/// Picture of all axes of a study.
pub fn study_picture(table: &StudyTable) -> String {
    let rows = table.axes.len().div_ceil(COLUMNS).max(1);
    let width = PANEL_PX[0] * COLUMNS as f64 + 16.0;
    let height = TOP_PX + PANEL_PX[1] * rows as f64 + 8.0;
    let s = &table.settings;
    let title =
        format!("{} on {}, {}, {} trials each", s.network, s.map, s.condition, s.flight.trials);
    let (energy_max, time_max) = (largest(table, energy_uj), largest(table, time_us));
    let mut svg = svg_open(width, height, 11);
    let _ = write!(
        svg,
        r#"<text x="12" y="20" font-size="14">{}</text><text x="12" y="38"><tspan fill="{SUCCESS_COLOUR}">success with 95 % interval (dashed: float network)</tspan>, per decision ({COST_TABLE}): <tspan fill="{ENERGY_COLOUR}">dynamic energy, uJ</tspan>, <tspan fill="{TIME_COLOUR}">chip time (top: {} us)</tspan>; x: does not fly</text>"#,
        escape(&title),
        digits(time_max)
    );
    for (index, axis) in table.axes.iter().enumerate() {
        let (column, row) = (index % COLUMNS, index / COLUMNS);
        let panel = Panel {
            left: 8.0 + PANEL_PX[0] * column as f64 + LEFT_PX,
            top: TOP_PX + PANEL_PX[1] * row as f64 + ABOVE_PX,
            values: axis.rows.len(),
            energy_max,
            time_max,
        };
        panel.draw(&mut svg, table, axis);
    }
    svg.push_str("</svg>\n");
    svg
}

/// Largest of all points, so that panels can be compared; 1 when there is none.
fn largest(table: &StudyTable, of: fn(&OnChip) -> Option<f64>) -> f64 {
    let flown = table.points.iter().filter_map(|point| point.flown());
    let largest = flown.filter_map(of).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

fn energy_uj(flown: &OnChip) -> Option<f64> {
    let summary = &flown.tried.summary;
    let cost = summary.chip.as_ref()?.costs.get(COST_TABLE)?;
    Some(cost.dynamic_fj as f64 / summary.decisions.max(1) as f64 / 1e9)
}

fn time_us(flown: &OnChip) -> Option<f64> {
    let summary = &flown.tried.summary;
    let cost = summary.chip.as_ref()?.costs.get(COST_TABLE)?;
    Some(cost.time_ps as f64 / summary.decisions.max(1) as f64 / 1e6)
}

struct Panel {
    left: f64,
    top: f64,
    values: usize,
    energy_max: f64,
    time_max: f64,
}

impl Panel {
    const WIDTH: f64 = PANEL_PX[0] - LEFT_PX - RIGHT_PX;
    const HEIGHT: f64 = PANEL_PX[1] - ABOVE_PX - BELOW_PX;

    fn x(&self, index: usize) -> f64 {
        self.left + Self::WIDTH * (index as f64 + 0.5) / self.values.max(1) as f64
    }

    /// Height of a share of the panel.
    fn y(&self, share: f64) -> f64 {
        self.top + Self::HEIGHT * (1.0 - share)
    }

    fn draw(&self, svg: &mut String, table: &StudyTable, axis: &AxisRows) {
        self.frame(svg, axis);
        if let Some(float) = &table.float {
            let (right, y) = (self.left + Self::WIDTH, self.y(float.rate()));
            let _ = write!(
                svg,
                r##"<line x1="{:.1}" y1="{y:.1}" x2="{right:.1}" y2="{y:.1}" stroke="#555" stroke-dasharray="5 4"/>"##,
                self.left
            );
        }
        let (mut success, mut energy, mut time) = (Vec::new(), Vec::new(), Vec::new());
        for (index, (label, variant)) in axis.rows.iter().enumerate() {
            let x = self.x(index);
            let below = self.y(0.0) + 14.0;
            let _ = write!(
                svg,
                r#"<text x="{x:.1}" y="{below:.1}" text-anchor="middle">{}</text>"#,
                escape(label)
            );
            let Some(point) = table.find(variant) else { continue };
            let Some(flown) = point.flown() else {
                let y = self.y(0.0) - 4.0;
                let _ = write!(
                    svg,
                    r##"<text x="{x:.1}" y="{y:.1}" text-anchor="middle" fill="#555">x</text>"##
                );
                continue;
            };
            self.interval(svg, x, flown);
            success.push((x, self.y(flown.tried.rate())));
            energy.extend(energy_uj(flown).map(|uj| (x, self.y(uj / self.energy_max))));
            time.extend(time_us(flown).map(|us| (x, self.y(us / self.time_max))));
        }
        line(svg, &time, TIME_COLOUR, 1.2, 0.8);
        line(svg, &energy, ENERGY_COLOUR, 1.2, 0.8);
        line(svg, &success, SUCCESS_COLOUR, 1.8, 1.0);
    }

    fn frame(&self, svg: &mut String, axis: &AxisRows) {
        let (left, right) = (self.left - 5.0, self.left + Self::WIDTH + 5.0);
        let _ = write!(
            svg,
            r##"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="none" stroke="#bbb"/><text x="{:.1}" y="{:.1}">{}: {}</text>"##,
            self.left,
            self.top,
            Self::WIDTH,
            Self::HEIGHT,
            self.left,
            self.top - 8.0,
            escape(&axis.name),
            escape(&axis.about)
        );
        for share in [0.0, 0.5, 1.0] {
            let y = self.y(share) + 4.0;
            let _ = write!(
                svg,
                r#"<text x="{left:.1}" y="{y:.1}" text-anchor="end" fill="{SUCCESS_COLOUR}">{share:.1}</text><text x="{right:.1}" y="{y:.1}" fill="{ENERGY_COLOUR}">{}</text>"#,
                digits(share * self.energy_max)
            );
        }
    }

    fn interval(&self, svg: &mut String, x: f64, flown: &OnChip) {
        let (low, high) = flown.tried.interval();
        let _ = write!(
            svg,
            r#"<line x1="{x:.1}" y1="{:.1}" x2="{x:.1}" y2="{:.1}" stroke="{SUCCESS_COLOUR}"/>"#,
            self.y(low),
            self.y(high)
        );
    }
}

fn line(svg: &mut String, points: &[(f64, f64)], colour: &str, width: f64, opacity: f64) {
    let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ = write!(
        svg,
        r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}"/>"#,
        path.join(" ")
    );
    for (x, y) in points {
        let _ = write!(
            svg,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{:.1}" fill="{colour}" fill-opacity="{opacity}"/>"#,
            width + 0.8
        );
    }
}

/// Enough digits to tell values of one picture apart.
fn digits(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        _ if value >= 100.0 => format!("{value:.0}"),
        _ if value >= 1.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}
