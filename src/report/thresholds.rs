//! Firing thresholds by layer (the paper's fig:4): table and bars.

use std::fmt::Write;

use comfy_table::Table;
use serde::{Deserialize, Serialize};

use crate::report::plot::{escape, svg_open};
use crate::report::tables::plain;

/// Threshold of every EEM-SAN layer before training, if the configuration says nothing else.
pub const THRESHOLD_INITIAL: f64 = 0.5;

/// Colours of the networks, over and over.
const COLOURS: [&str; 6] = ["#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b"];

/// Height of the largest bar and of what is around the bars, pixels.
const BAR_PX: f64 = 240.0;
const TOP_PX: f64 = 34.0;
const LEFT_PX: f64 = 48.0;
/// Width of a bar where there is room, and of what all bars of a layer have at most; least width of
/// a layer's name.
const BAR_WIDTH_PX: f64 = 26.0;
const BARS_WIDTH_PX: f64 = 240.0;
const LAYER_WIDTH_PX: f64 = 84.0;

/// Thresholds of several networks, as `thresholds --json` writes them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThresholdsResult {
    /// Revision of the program.
    pub revision: String,
    /// The networks.
    pub thresholds: Vec<Thresholds>,
}

/// Thresholds of one network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Name.
    pub network: String,
    /// SHA-256 of the network.
    #[serde(default)]
    pub digest: Option<String>,
    /// Name and threshold of each layer.
    pub layers: Vec<(String, f64)>,
}

/// A row for each network, a column for each layer.
pub fn thresholds_table(networks: &[Thresholds]) -> Table {
    let layers = layers(networks);
    let header: Vec<&str> = ["network"].into_iter().chain(layers.iter().copied()).collect();
    let mut table = plain(&header);
    for network in networks {
        let cell = |layer: &&str| {
            of(network, layer).map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"))
        };
        table.add_row([network.network.clone()].into_iter().chain(layers.iter().map(cell)));
    }
    table
}

/// Bars by layer, one colour for each network, with the usual initial threshold as a line.
pub fn thresholds_picture(networks: &[Thresholds]) -> String {
    let layers = layers(networks);
    let values = networks.iter().flat_map(|network| &network.layers).map(|(_, value)| *value);
    let highest = values.fold(2.0 * THRESHOLD_INITIAL, f64::max);
    let n = networks.len().max(1) as f64;
    let bar = BAR_WIDTH_PX.min(BARS_WIDTH_PX / n);
    let group = (bar * n + 16.0).max(LAYER_WIDTH_PX);
    let bars = Bars { y_px_per_unit: BAR_PX / highest, group_px: group, bar_px: bar };
    let width = LEFT_PX + group * layers.len().max(3) as f64 + 16.0;
    let height = TOP_PX + BAR_PX + 36.0 + 20.0 * networks.len() as f64;
    let mut svg = svg_open(width, height, 13);
    let _ = write!(
        svg,
        r#"<text x="{LEFT_PX}" y="20">Firing threshold by layer (dashed: 0.5, the usual start)</text>"#
    );
    for (index, layer) in layers.iter().enumerate() {
        bars.layer(&mut svg, networks, layer, index);
    }
    bars.axes(&mut svg, highest, width);
    for (index, network) in networks.iter().enumerate() {
        let y = TOP_PX + BAR_PX + 36.0 + 20.0 * index as f64;
        let colour = COLOURS[index % COLOURS.len()];
        let _ = write!(
            svg,
            r#"<rect x="{LEFT_PX}" y="{y:.0}" width="12" height="12" fill="{colour}"/><text x="{:.0}" y="{:.0}">{}</text>"#,
            LEFT_PX + 18.0,
            y + 11.0,
            escape(&network.network)
        );
    }
    svg.push_str("</svg>\n");
    svg
}

struct Bars {
    y_px_per_unit: f64,
    group_px: f64,
    /// From one bar to the next.
    bar_px: f64,
}

impl Bars {
    fn y(&self, value: f64) -> f64 {
        TOP_PX + BAR_PX - value * self.y_px_per_unit
    }

    fn layer(&self, svg: &mut String, networks: &[Thresholds], layer: &str, index: usize) {
        let left = LEFT_PX + self.group_px * index as f64;
        for (index, network) in networks.iter().enumerate() {
            let Some(value) = of(network, layer) else { continue };
            let (x, y) = (left + 8.0 + self.bar_px * index as f64, self.y(value));
            let _ = write!(
                svg,
                r#"<rect x="{x:.1}" y="{y:.1}" width="{:.1}" height="{:.1}" fill="{}"><title>{}: {value:.4}</title></rect>"#,
                self.bar_px * 0.88,
                TOP_PX + BAR_PX - y,
                COLOURS[index % COLOURS.len()],
                escape(&network.network)
            );
        }
        let _ = write!(
            svg,
            r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
            left + 8.0,
            TOP_PX + BAR_PX + 18.0,
            escape(layer)
        );
    }

    fn axes(&self, svg: &mut String, highest: f64, width: f64) {
        for value in [0.0, THRESHOLD_INITIAL, highest] {
            let y = self.y(value);
            let dashes = if value == THRESHOLD_INITIAL { "6 4" } else { "none" };
            let _ = write!(
                svg,
                r##"<line x1="{LEFT_PX}" y1="{y:.1}" x2="{:.1}" y2="{y:.1}" stroke="#333333" stroke-dasharray="{dashes}"/><text x="10" y="{:.1}">{value:.2}</text>"##,
                width - 16.0,
                y + 4.0
            );
        }
    }
}

/// Layers of all networks, each once.
fn layers(networks: &[Thresholds]) -> Vec<&str> {
    let mut layers: Vec<&str> = Vec::new();
    for (layer, _) in networks.iter().flat_map(|network| &network.layers) {
        if !layers.contains(&layer.as_str()) {
            layers.push(layer);
        }
    }
    layers
}

fn of(network: &Thresholds, layer: &str) -> Option<f64> {
    network.layers.iter().find(|(name, _)| name == layer).map(|(_, value)| *value)
}
