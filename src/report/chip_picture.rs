//! A picture of the chip as SVG: its tiles and cores, coloured by layer, by use of memory and by
//! what they did in a run.

use std::fmt::Write;

use hw_model::CoreMap;
use hw_model::core_map::CoreUse;
use hw_model::id::CoreId;

use crate::report::activity::CoreActivity;
use crate::report::plot::escape;

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
    fn title(&self, name: &str, map: &CoreMap) -> String {
        match self {
            View::Layer => {
                let (cores, chip) = (map.core_usage(), escape(&map.chip().name));
                format!(
                    "{} on {chip}: {} of {} cores, by layer",
                    escape(name),
                    cores.used,
                    cores.limit
                )
            }
            View::Memory => "synapse memory in use, white 0 % to dark 100 %".to_owned(),
            View::Activity(activity) => format!(
                "synaptic operations per {}, white 0 to dark {:.0}",
                activity.unit(),
                activity.most()
            ),
        }
    }

    fn colour(&self, used: &CoreUse, layer: Option<usize>) -> String {
        match self {
            View::Layer => layer.map_or("#ffffff", colour_of).to_owned(),
            View::Memory => {
                let words = used.synapse_words;
                shade(words.used as f64 / words.limit.max(1) as f64)
            }
            View::Activity(activity) => {
                shade(activity.synaptic_ops(usize::from(used.core)) / activity.most().max(1e-9))
            }
        }
    }
}

/// All views side by side, with a legend of layers below; a view of the activity when there is
/// one, which must be of `map`.
pub fn chip_picture(name: &str, map: &CoreMap, activity: Option<&CoreActivity>) -> String {
    let layers = layer_of_core(map);
    let use_of_cores = map.utilization();
    let plan = Plan::new(map);
    let views = [View::Layer, View::Memory].into_iter().chain(activity.map(View::Activity));
    let views: Vec<View> = views.collect();
    let legend_px = LINE_PX * (map.populations().len() as u32 + 1);
    let across = views.len() as u32;
    let (width, height) = (
        across * plan.width + (across + 1) * MARGIN_PX,
        TITLE_PX + plan.height + legend_px + 2 * MARGIN_PX,
    );
    let mut svg = String::new();
    let _ = write!(
        svg,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13"><rect width="100%" height="100%" fill="white"/>"#
    );
    for (index, view) in views.iter().enumerate() {
        let left = MARGIN_PX + index as u32 * (plan.width + MARGIN_PX);
        let _ = write!(svg, r#"<text x="{left}" y="24">{}</text>"#, view.title(name, map));
        for core in 0..map.chip().limits.cores as u16 {
            let used = use_of_cores.get(usize::from(core));
            let layer = layers.get(usize::from(core)).copied().flatten();
            let colour = used.map_or_else(|| UNUSED.to_owned(), |used| view.colour(used, layer));
            let title = used.map_or_else(
                || format!("core {core}: not in use"),
                |used| {
                    about(used)
                        + &activity.map_or_else(String::new, |a| a.about(usize::from(used.core)))
                },
            );
            let (x, y) = plan.place(core);
            let _ = write!(
                svg,
                r##"<rect x="{}" y="{}" width="{CORE_PX}" height="{CORE_PX}" fill="{colour}" stroke="#888888"><title>{}</title></rect>"##,
                left + x,
                TITLE_PX + y,
                escape(&title)
            );
        }
    }
    legend(&mut svg, map, TITLE_PX + plan.height + MARGIN_PX);
    svg.push_str("</svg>\n");
    svg
}

/// Where the cores lie, in pixels from the corner of a view.
struct Plan<'a> {
    map: &'a CoreMap,
    /// Cores side by side within a tile.
    across: u32,
    tile_px: [u32; 2],
    width: u32,
    height: u32,
}

impl<'a> Plan<'a> {
    fn new(map: &'a CoreMap) -> Self {
        let mesh = &map.chip().mesh;
        let per_tile = u32::from(mesh.cores_per_tile);
        let across = (1..=per_tile).find(|n| n * n >= per_tile).unwrap_or(1);
        let tile_px = [across, per_tile.div_ceil(across)].map(|n| n * CORE_PX + TILE_GAP_PX);
        let (width, height) =
            (u32::from(mesh.tiles_x) * tile_px[0], u32::from(mesh.tiles_y) * tile_px[1]);
        Self { map, across, tile_px, width, height }
    }

    fn place(&self, core: u16) -> (u32, u32) {
        let mesh = &self.map.chip().mesh;
        let (x, y) = mesh.tile(core);
        let within = u32::from(core % mesh.cores_per_tile);
        (
            u32::from(x) * self.tile_px[0] + within % self.across * CORE_PX,
            u32::from(y) * self.tile_px[1] + within / self.across * CORE_PX,
        )
    }
}

/// The population that has most compartments of each core.
fn layer_of_core(map: &CoreMap) -> Vec<Option<usize>> {
    let mut most = vec![(0, None); map.cores().len()];
    for (index, population) in map.populations().iter().enumerate() {
        let mut of_core = vec![0u32; map.cores().len()];
        population.slices.iter().for_each(|s| of_core[s.core.index()] += u32::from(s.len));
        for (most, count) in most.iter_mut().zip(of_core) {
            if count > most.0 {
                *most = (count, Some(index));
            }
        }
    }
    most.into_iter().map(|(_, layer)| layer).collect()
}

fn colour_of(layer: usize) -> &'static str {
    COLOURS[layer % COLOURS.len()]
}

/// White to dark blue by a share, 0 to 1.
fn shade(share: f64) -> String {
    let share = (share.clamp(0.0, 1.0) * 200.0) as u64;
    format!("rgb({},{},{})", 255 - share, 255 - share * 3 / 4, 255 - share / 3)
}

fn about(used: &CoreUse) -> String {
    let of = |usage: hw_model::core_map::Usage| format!("{}/{}", usage.used, usage.limit);
    format!(
        "core {} {}: {} compartments, {} input axons, {} output axons, {} synapse words",
        used.core,
        used.label,
        of(used.compartments),
        of(used.input_axons),
        of(used.output_axons),
        of(used.synapse_words)
    )
}

fn legend(svg: &mut String, map: &CoreMap, top: u32) {
    for (index, population) in map.populations().iter().enumerate() {
        let y = top + LINE_PX * index as u32;
        let cores = cores_of(map, index);
        let _ = write!(
            svg,
            r##"<rect x="{MARGIN_PX}" y="{y}" width="14" height="14" fill="{}" stroke="#888888"/><text x="{}" y="{}">{}: {} neurons on {} cores</text>"##,
            colour_of(index),
            MARGIN_PX + 22,
            y + 12,
            escape(&population.name),
            population.len(),
            cores.len()
        );
    }
}

/// Cores on which population number `population` lies, sorted.
pub fn cores_of(map: &CoreMap, population: usize) -> Vec<CoreId> {
    let mut cores: Vec<CoreId> =
        map.populations()[population].slices.iter().map(|slice| slice.core).collect();
    cores.sort_unstable();
    cores.dedup();
    cores
}

#[cfg(test)]
#[path = "chip_picture_tests.rs"]
mod tests;
