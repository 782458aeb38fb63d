//! Trajectories as SVG: start blue, goal red, failures marked.

use std::fmt::Write;

use crate::report::results::{ArenaPicture, DriveResult, DriverResult};

/// Pixels per metre of the largest picture side of 20 m.
const SIDE_PX: f64 = 640.0;
const MARGIN_PX: f64 = 34.0;
/// Distance between drawn points of a trajectory.
const STRIDE_MM: u32 = 120;

/// Picture of every driver of a result, side by side.
pub fn trajectories(result: &DriveResult) -> String {
    let sheet = Sheet::new(&result.arena);
    let mut svg = sheet.open(result.drivers.len());
    for (index, driver) in result.drivers.iter().enumerate() {
        let _ = write!(svg, "<g>");
        sheet.frame(index).panel(&mut svg, result, driver);
        let _ = write!(svg, "</g>");
    }
    svg.push_str("</svg>\n");
    svg
}

/// Picture of an arena; movers are at the start of their tracks, with their speeds (m/s).
pub fn arena_picture(arena: &ArenaPicture) -> String {
    let sheet = Sheet::new(arena);
    let mut svg = sheet.open(1);
    let frame = sheet.frame(0);
    frame.arena(&mut svg, arena);
    frame.speeds(&mut svg, arena);
    let _ = write!(svg, r#"<text x="{MARGIN_PX}" y="14">{}</text>"#, escape(&arena.caption()));
    svg.push_str("</svg>\n");
    svg
}

/// Size and scale of a picture.
pub(super) struct Sheet {
    scale: f64,
    x0: f64,
    y1: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Sheet {
    pub(super) fn new(arena: &ArenaPicture) -> Self {
        let [x0, y0, x1, y1] = arena.bounds_m;
        let scale = SIDE_PX / (x1 - x0).max(y1 - y0).max(1e-9);
        let side = |length_m: f64| length_m * scale + 2.0 * MARGIN_PX;
        Self { scale, x0, y1, width: side(x1 - x0), height: side(y1 - y0) }
    }

    fn open(&self, panels: usize) -> String {
        svg_open(self.width * panels.max(1) as f64, self.height, 13)
    }

    pub(super) fn frame(&self, panel: usize) -> Frame {
        let left = self.width * panel as f64;
        Frame { scale: self.scale, x0: self.x0, y1: self.y1, left }
    }
}

/// Metres to pixels of one panel; y points up in the world and down in the picture.
pub(super) struct Frame {
    pub(super) scale: f64,
    x0: f64,
    y1: f64,
    left: f64,
}

impl Frame {
    pub(super) fn x(&self, x_m: f64) -> f64 {
        self.left + MARGIN_PX + (x_m - self.x0) * self.scale
    }

    pub(super) fn y(&self, y_m: f64) -> f64 {
        MARGIN_PX + (self.y1 - y_m) * self.scale
    }

    fn panel(&self, svg: &mut String, result: &DriveResult, driver: &DriverResult) {
        self.arena(svg, &result.arena);
        let s = &driver.summary;
        let _ = write!(
            svg,
            r#"<text x="{:.0}" y="14">{}, seed {}: {} of {} reached the goal (start blue, goal red, failure x)</text>"#,
            self.left + MARGIN_PX,
            escape(&driver.label),
            driver.seed,
            s.success,
            s.trials
        );
        for trial in &driver.trials {
            let failed = trial.outcome != "success";
            let (colour, width, opacity) =
                if failed { ("#d62728", 1.6, 0.9) } else { ("#555555", 0.7, 0.35) };
            self.path(svg, &trial.trajectory_mm, colour, width, opacity);
        }
        for trial in &driver.trials {
            let Some([sx, sy, _, gx, gy]) = result.pairs_mm.get(trial.trial).copied() else {
                continue;
            };
            self.dot(svg, sx, sy, "#1f77b4");
            self.dot(svg, gx, gy, "#d62728");
            if let (true, Some([x, y, _])) =
                (trial.outcome != "success", trial.trajectory_mm.last())
            {
                let (x, y) = (self.x(f64::from(*x) / 1e3), self.y(f64::from(*y) / 1e3));
                let _ = write!(
                    svg,
                    r##"<path d="M{:.1} {:.1}l12 12m0 -12l-12 12" stroke="#000" stroke-width="2.2"><title>trial {}: {}{}</title></path>"##,
                    x - 6.0,
                    y - 6.0,
                    trial.trial,
                    escape(&trial.outcome),
                    trial
                        .hit
                        .as_ref()
                        .map_or_else(String::new, |hit| format!(" with {}", escape(hit)))
                );
            }
        }
    }

    pub(super) fn arena(&self, svg: &mut String, arena: &ArenaPicture) {
        let [x0, y0, x1, y1] = arena.bounds_m;
        for polygon in &arena.polygons_m {
            let points: Vec<String> = polygon
                .iter()
                .map(|[x, y]| {
                    format!(
                        "{:.1},{:.1}",
                        self.x(x.clamp(x0 - 0.4, x1 + 0.4)),
                        self.y(y.clamp(y0 - 0.4, y1 + 0.4))
                    )
                })
                .collect();
            let _ = write!(svg, r##"<polygon points="{}" fill="#9aa3ad"/>"##, points.join(" "));
        }
        for [x, y, r] in &arena.discs_m {
            let _ = write!(
                svg,
                r##"<circle cx="{:.1}" cy="{:.1}" r="{:.1}" fill="#9aa3ad"/>"##,
                self.x(*x),
                self.y(*y),
                r * self.scale
            );
        }
        for [ax, ay, bx, by, r, _] in &arena.movers_m {
            let (ax, ay, bx, by, r) =
                (self.x(*ax), self.y(*ay), self.x(*bx), self.y(*by), r * self.scale);
            let _ = write!(
                svg,
                r##"<line x1="{ax:.1}" y1="{ay:.1}" x2="{bx:.1}" y2="{by:.1}" stroke="#ff9f1c" stroke-dasharray="5 4"/><circle cx="{ax:.1}" cy="{ay:.1}" r="{r:.1}" fill="#ff9f1c"/>"##
            );
        }
    }

    fn speeds(&self, svg: &mut String, arena: &ArenaPicture) {
        for [x, y, _, _, radius, speed] in &arena.movers_m {
            let _ = write!(
                svg,
                r#"<text x="{:.1}" y="{:.1}" font-size="11">{speed:.2}</text>"#,
                self.x(*x) + radius * self.scale + 2.0,
                self.y(*y) + 4.0
            );
        }
    }

    pub(super) fn path(
        &self,
        svg: &mut String,
        points: &[[i32; 3]],
        colour: &str,
        width: f64,
        opacity: f64,
    ) {
        let points: Vec<String> = thinned(points)
            .map(|[x, y, _]| {
                format!("{:.1},{:.1}", self.x(f64::from(x) / 1e3), self.y(f64::from(y) / 1e3))
            })
            .collect();
        let _ = write!(
            svg,
            r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-opacity="{opacity}"/>"#,
            points.join(" ")
        );
    }

    fn dot(&self, svg: &mut String, x_mm: i32, y_mm: i32, colour: &str) {
        let (x, y) = (self.x(f64::from(x_mm) / 1e3), self.y(f64::from(y_mm) / 1e3));
        let _ = write!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.2" fill="{colour}"/>"#);
    }
}

/// Points at least [`STRIDE_MM`] apart, and the last one.
fn thinned(points: &[[i32; 3]]) -> impl Iterator<Item = [i32; 3]> + '_ {
    let mut drawn: Option<[i32; 3]> = None;
    let last = points.len().saturating_sub(1);
    points.iter().enumerate().filter_map(move |(index, point)| {
        let far = drawn.is_none_or(|[x, y, _]| {
            x.abs_diff(point[0]).saturating_add(y.abs_diff(point[1])) >= STRIDE_MM
        });
        (far || index == last).then(|| *drawn.insert(*point))
    })
}

/// The beginning of a picture of this size, pixels, on white.
pub(super) fn svg_open(width: f64, height: f64, font_px: u32) -> String {
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" font-family="sans-serif" font-size="{font_px}"><rect width="100%" height="100%" fill="white"/>"#
    )
}

/// Text safe inside SVG and HTML, which cannot hold control characters.
pub fn escape(text: &str) -> String {
    let shown = |c: char| if c.is_control() && c != '\n' { '\u{fffd}' } else { c };
    let text: String = text.chars().map(shown).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
