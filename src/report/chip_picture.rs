//! A picture of the chip as SVG: its tiles and cores, coloured by layer, by use of memory and by
//! what they did in a run.

use std::fmt::Write;

use hw_model::core_map::CoreUse;
use hw_model::spec::Mesh;

use crate::report::activity::CoreActivity;
use crate::report::chip_plan::ChipPlan;
use crate::report::plot::{escape, svg_open};

const CORE_PX: u32 = 26;
const TILE_GAP_PX: u32 = 8;
const MARGIN_PX: u32 = 20;
const LINE_PX: u32 = 20;
const TITLE_PX: u32 = 34;
const UNUSED: &str = "#eeeeee";
/// Apart from each other for most eyes; further layers begin again.
const COLOURS: [&str; 12] = [
    "#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#e69f00", "#44bb99",
    "#994455", "#997700", "#6699cc", "#bbbbbb",
];

/// How a view colours its cores.
enum View<'a> {
    Layer,
    Memory,
    Activity(&'a CoreActivity),
}

impl View<'_> {
    fn title(&self, plan: &ChipPlan) -> String {
        match self {
            View::Layer => {
                let (name, chip) = (escape(&plan.network), escape(&plan.chip));
                let cores = plan.cores;
                format!("{name} on {chip}: {} of {} cores, by layer", cores.used, cores.limit)
            }
            View::Memory => "synapse memory in use, white 0 % to dark 100 %".to_owned(),
            View::Activity(activity) => format!(
                "synaptic operations per {}, white 0 to dark {:.0}",
                activity.unit(),
                activity.most()
            ),
        }
    }

    fn colour(&self, used: &CoreUse, plan: &ChipPlan, core: u16) -> String {
        match self {
            View::Layer => layer_colour(plan, core).to_owned(),
            View::Memory => {
                let words = used.synapse_words;
                shade(words.used as f64 / words.limit.max(1) as f64)
            }
            View::Activity(activity) => {
                shade(activity.synaptic_ops(usize::from(core)) / activity.most().max(1e-9))
            }
        }
    }
}

/// All views side by side, with a legend of layers below; a view of the activity when there is
/// one, which must be of the same map.
pub fn chip_picture(plan: &ChipPlan, activity: Option<&CoreActivity>) -> String {
    let layout = Layout::new(&plan.mesh);
    let views = [View::Layer, View::Memory].into_iter().chain(activity.map(View::Activity));
    let views: Vec<View> = views.collect();
    let legend_px = LINE_PX * plan.populations.len() as u32;
    let across = views.len() as u32;
    let (width, height) = (
        across * layout.width + (across + 1) * MARGIN_PX,
        TITLE_PX + layout.height + legend_px + 2 * MARGIN_PX,
    );
    let mut svg = svg_open(width.into(), height.into(), 13);
    for (index, view) in views.iter().enumerate() {
        let left = MARGIN_PX + index as u32 * (layout.width + MARGIN_PX);
        let _ = write!(svg, r#"<text x="{left}" y="24">{}</text>"#, view.title(plan));
        for core in 0..plan.cores.limit as u16 {
            let Some(used) = plan.utilization.get(usize::from(core)) else {
                let title = format!("core {core}: not in use");
                layout.core(&mut svg, core, [left, TITLE_PX], UNUSED, &title);
                continue;
            };
            let did = activity.map_or_else(String::new, |a| a.about(usize::from(core)));
            let (colour, title) = (view.colour(used, plan, core), about(used) + &did);
            layout.core(&mut svg, core, [left, TITLE_PX], &colour, &title);
        }
    }
    legend(&mut svg, plan, TITLE_PX + layout.height + MARGIN_PX);
    svg.push_str("</svg>\n");
    svg
}

/// Cores as strong as the root of their share of the busiest one's `counts`.
pub fn activity_picture(plan: &ChipPlan, counts: &[u64]) -> String {
    let [width, height] = cores_size(plan);
    let (width, height) = (width + 2 * MARGIN_PX, height + TITLE_PX + MARGIN_PX);
    let most = counts.iter().copied().max().unwrap_or(0);
    let mut svg = svg_open(width.into(), height.into(), 13);
    let _ = write!(
        svg,
        r#"<text x="{MARGIN_PX}" y="24">synaptic operations, up to {most} on a core</text>"#
    );
    glowing_cores(&mut svg, plan, [MARGIN_PX, TITLE_PX], counts);
    svg.push_str("</svg>\n");
    svg
}

/// The cores alone with the top left corner at `corner`, as strong as [`activity_picture`] has them.
pub(super) fn glowing_cores(svg: &mut String, plan: &ChipPlan, corner: [u32; 2], counts: &[u64]) {
    let scale = |n: u64| libm::sqrt(n as f64);
    let most = counts.iter().copied().max().map_or(1.0, scale).max(1.0);
    let layout = Layout::new(&plan.mesh);
    for core in 0..plan.cores.limit as u16 {
        let Some(used) = plan.utilization.get(usize::from(core)) else {
            layout.core(svg, core, corner, UNUSED, &format!("core {core}: not in use"));
            continue;
        };
        let opacity = 0.12 + 0.88 * counts.get(usize::from(core)).map_or(0.0, |n| scale(*n) / most);
        let _ = write!(svg, r#"<g fill-opacity="{opacity:.2}">"#);
        layout.core(svg, core, corner, layer_colour(plan, core), &about(used));
        svg.push_str("</g>");
    }
}

/// Width and height of the cores alone, pixels.
pub(super) fn cores_size(plan: &ChipPlan) -> [u32; 2] {
    let layout = Layout::new(&plan.mesh);
    [layout.width, layout.height]
}

/// Where the cores lie, in pixels from the corner of a view.
struct Layout<'a> {
    mesh: &'a Mesh,
    /// Cores side by side within a tile.
    across: u32,
    tile_px: [u32; 2],
    width: u32,
    height: u32,
}

impl<'a> Layout<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let per_tile = u32::from(mesh.cores_per_tile);
        let across = (1..=per_tile).find(|n| n * n >= per_tile).unwrap_or(1);
        let tile_px = [across, per_tile.div_ceil(across)].map(|n| n * CORE_PX + TILE_GAP_PX);
        let (width, height) =
            (u32::from(mesh.tiles_x) * tile_px[0], u32::from(mesh.tiles_y) * tile_px[1]);
        Self { mesh, across, tile_px, width, height }
    }

    fn place(&self, core: u16) -> (u32, u32) {
        let (x, y) = self.mesh.tile(core);
        let within = u32::from(core % self.mesh.cores_per_tile);
        (
            u32::from(x) * self.tile_px[0] + within % self.across * CORE_PX,
            u32::from(y) * self.tile_px[1] + within / self.across * CORE_PX,
        )
    }

    fn core(&self, svg: &mut String, core: u16, corner: [u32; 2], colour: &str, title: &str) {
        let (x, y) = self.place(core);
        let _ = write!(
            svg,
            r##"<rect x="{}" y="{}" width="{CORE_PX}" height="{CORE_PX}" fill="{colour}" stroke="#888888"><title>{}</title></rect>"##,
            corner[0] + x,
            corner[1] + y,
            escape(title)
        );
    }
}

fn layer_colour(plan: &ChipPlan, core: u16) -> &'static str {
    let layer = plan.layer_of_core.get(usize::from(core)).copied().flatten();
    layer.map_or("#ffffff", colour_of)
}

pub(super) fn colour_of(layer: usize) -> &'static str {
    COLOURS[layer % COLOURS.len()]
}

/// White to dark blue by a share, 0 to 1.
fn shade(share: f64) -> String {
    let share = (share.clamp(0.0, 1.0) * 200.0) as u64;
    format!("rgb({},{},{})", 255 - share, 255 - share * 3 / 4, 255 - share / 3)
}

fn about(used: &CoreUse) -> String {
    format!(
        "core {} {}: {} compartments, {} input axons, {} output axons, {} synapse words",
        used.core,
        used.label,
        used.compartments,
        used.input_axons,
        used.output_axons,
        used.synapse_words
    )
}

fn legend(svg: &mut String, plan: &ChipPlan, top: u32) {
    for (index, layer) in plan.populations.iter().enumerate() {
        let y = top + LINE_PX * index as u32;
        let _ = write!(
            svg,
            r##"<rect x="{MARGIN_PX}" y="{y}" width="14" height="14" fill="{}" stroke="#888888"/><text x="{}" y="{}">{}: {} neurons on {} core{}</text>"##,
            colour_of(index),
            MARGIN_PX + 22,
            y + 12,
            escape(&layer.name),
            layer.neurons,
            layer.cores,
            if layer.cores == 1 { "" } else { "s" }
        );
    }
}

#[cfg(test)]
#[path = "chip_picture_tests.rs"]
mod tests;
