//! One tick of a replay as a still picture (SVG): for print, and where no script runs.

use std::fmt::Write;

use super::{Episode, Replay, ReplayTick, codec};
use crate::report::chip_picture::{cores_size, glowing_cores};
use crate::report::plot::{Frame, Sheet, escape, svg_open};

/// Pixels between panels, and for a panel's title.
const GAP_PX: f64 = 24.0;
const TITLE_PX: f64 = 34.0;
/// Side of the event frame on the picture, and height of the raster.
const EVENTS_PX: f64 = 256.0;
const RASTER_PX: f64 = 260.0;
/// Width of the panels right of the arena, at least.
const SIDE_PX: f64 = 580.0;
/// The fan is drawn up to this range.
const LASER_M_MAX: f64 = 8.0;
/// Width of a laser sector and direction of the leftmost one, degrees.
const SECTOR_DEG: f64 = 10.0;
const LEFTMOST_DEG: f64 = 85.0;
/// Ink of spikes, readable on white and on black.
const SPIKE_RGB: [u8; 3] = [0x4a, 0x86, 0xc5];
/// Shades of the event frames of a tick, newest first.
const EVENT_OPACITY: [f64; 5] = [1.0, 0.6, 0.4, 0.27, 0.18];

/// Arena, event frame, chip and spikes at tick `tick` of an episode (the last one there is, if it
/// is shorter).
///
/// Panics without such an episode.
pub fn frame_picture(replay: &Replay, episode: usize, tick: usize) -> String {
    let episode = &replay.episodes[episode];
    let tick = tick.min(episode.ticks.len().saturating_sub(1));
    let sheet = Sheet::new(&replay.arena);
    let chip_px = replay.chip.as_ref().map_or([0, 0], cores_size).map(f64::from);
    let side = sheet.width + GAP_PX;
    let (width, top) = (side + chip_px[0].max(SIDE_PX) + GAP_PX, TITLE_PX);
    let body = sheet.height.max(top + EVENTS_PX + GAP_PX + TITLE_PX + chip_px[1]);
    let height = body + TITLE_PX + RASTER_PX + GAP_PX;
    let mut svg = svg_open(width, height, 13);
    arena(&mut svg, replay, episode, tick, &sheet.frame(0));
    if let Some(at) = episode.ticks.get(tick) {
        events(&mut svg, replay, at, [side, top]);
        readout(&mut svg, replay, episode, tick, [side + EVENTS_PX + GAP_PX, top + 14.0]);
        chip(&mut svg, replay, at, [side, top + EVENTS_PX + GAP_PX + TITLE_PX]);
    }
    raster(&mut svg, replay, episode, tick, [GAP_PX, body + TITLE_PX, width - 2.0 * GAP_PX]);
    svg.push_str("</svg>\n");
    svg
}

fn arena(svg: &mut String, replay: &Replay, episode: &Episode, tick: usize, frame: &Frame) {
    let mut still = replay.arena.clone();
    let movers = std::mem::take(&mut still.movers_m);
    frame.arena(svg, &still);
    let metres = |mm: i32| f64::from(mm) / 1e3;
    let disc = |svg: &mut String, [x, y]: [i32; 2], radius_m: f64, ink: &str| {
        let (x, y, r) = (frame.x(metres(x)), frame.y(metres(y)), radius_m * frame.scale);
        let _ = write!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.1}" {ink}/>"#);
    };
    let [_, _, _, gx, gy] = episode.pair_mm;
    disc(svg, [gx, gy], replay.goal_radius_m, r##"fill="#d62728" fill-opacity="0.35""##);
    let places = episode.movers_mm.get(tick).map_or(&[][..], Vec::as_slice);
    for (place, mover) in places.iter().zip(&movers) {
        disc(svg, *place, mover[4], r##"fill="#ff9f1c""##);
    }
    if let (Some(at), Some(pose)) = (episode.ticks.get(tick), episode.poses_mm.get(tick)) {
        fan(svg, at, *pose, frame);
    }
    frame.path(svg, &episode.poses_mm, "#888888", 1.0, 0.5);
    let done = &episode.poses_mm[..=tick.min(episode.poses_mm.len() - 1)];
    frame.path(svg, done, "#1f77b4", 2.4, 1.0);
    if let Some([x, y, yaw]) = done.last() {
        disc(svg, [*x, *y], replay.robot_radius_m, r##"fill="#1f77b4""##);
        let (x, y, yaw) = (metres(*x), metres(*y), metres(*yaw));
        let nose = 2.0 * replay.robot_radius_m;
        let (nx, ny) = (x + nose * libm::cos(yaw), y + nose * libm::sin(yaw));
        let _ = write!(
            svg,
            r##"<line x1="{:.1}" y1="{:.1}" x2="{:.1}" y2="{:.1}" stroke="#1f77b4" stroke-width="3"/>"##,
            frame.x(x),
            frame.y(y),
            frame.x(nx),
            frame.y(ny)
        );
    }
    let hit = episode.hit.as_ref().map_or_else(String::new, |hit| format!(" with {hit}"));
    let title = format!(
        "{}, arena {}, seed {}, trial {}: {}{hit}",
        replay.driver, replay.arena.name, replay.seed, episode.trial, episode.outcome
    );
    let _ = write!(svg, r#"<text x="34" y="14">{}</text>"#, escape(&title));
}

/// The laser's sectors as wedges.
fn fan(svg: &mut String, tick: &ReplayTick, [x, y, yaw]: [i32; 3], frame: &Frame) {
    let [x, y, yaw] = [x, y, yaw].map(|milli| f64::from(milli) / 1e3);
    for (sector, range) in tick.laser_mm.iter().enumerate() {
        let range_m = (f64::from(*range) / 1e3).min(LASER_M_MAX);
        let corner = |side: f64| {
            let degrees = LEFTMOST_DEG - SECTOR_DEG * sector as f64 + side * SECTOR_DEG / 2.0;
            let angle = yaw + degrees.to_radians();
            [frame.x(x + range_m * libm::cos(angle)), frame.y(y + range_m * libm::sin(angle))]
        };
        let ([ax, ay], [bx, by]) = (corner(1.0), corner(-1.0));
        let _ = write!(
            svg,
            r##"<path d="M{:.1} {:.1}L{ax:.1} {ay:.1}L{bx:.1} {by:.1}Z" fill="#2ca02c" fill-opacity="0.16"/>"##,
            frame.x(x),
            frame.y(y)
        );
    }
}

/// The event frames of a tick on each other, older ones fainter.
fn events(svg: &mut String, replay: &Replay, tick: &ReplayTick, [left, top]: [f64; 2]) {
    let title = "event camera, the frames of this tick (newest darkest)";
    let _ = write!(svg, r#"<text x="{left:.0}" y="{:.0}">{title}</text>"#, top - 14.0);
    let _ = write!(
        svg,
        r##"<rect x="{left:.0}" y="{top:.0}" width="{EVENTS_PX}" height="{EVENTS_PX}" fill="#8888880f" stroke="#888888"/>"##
    );
    let rows = replay.frame_size[1].max(1);
    let px = EVENTS_PX / f64::from(replay.frame_size[0].max(rows));
    for (frame, opacity) in
        tick.frames.iter().zip(EVENT_OPACITY.iter().take(tick.frames.len()).rev())
    {
        let _ = write!(
            svg,
            r##"<g fill="#c2410c" fill-opacity="{opacity}" transform="translate({left:.0} {top:.0}) scale({px})"><path d=""##
        );
        for run in frame.chunk_by(|a, b| a + 1 == *b && b % rows > 0) {
            let _ = write!(svg, "M{} {}h1v{}h-1z", run[0] / rows, run[0] % rows, run.len());
        }
        svg.push_str(r#""/></g>"#);
    }
}

fn readout(
    svg: &mut String,
    replay: &Replay,
    episode: &Episode,
    tick: usize,
    [left, top]: [f64; 2],
) {
    let Some(at) = episode.ticks.get(tick) else { return };
    let hz = f64::from(replay.settings.control_hz.max(1));
    let milli = |value: i32| f64::from(value) / 1e3;
    let mut lines = vec![
        format!("tick {tick} of {}, {:.2} s", episode.ticks.len(), tick as f64 / hz),
        format!("goal at {:.2} m", f64::from(at.goal_mm) / 1e3),
        format!("{:.2} m/s, {:.2} rad/s", milli(at.speed[0]), milli(at.speed[1])),
        format!("wheels {:.2} and {:.2} of the fastest", milli(at.action[0]), milli(at.action[1])),
    ];
    let tables = replay.cost_tables.iter().zip(at.dynamic_fj.iter().zip(&at.time_ps));
    lines.extend(tables.map(|(name, (fj, ps))| {
        format!("{:.2} mJ, {:.1} ms so far ({name})", *fj as f64 / 1e12, *ps as f64 / 1e9)
    }));
    for (index, line) in lines.iter().enumerate() {
        let y = top + 20.0 * index as f64;
        let _ = write!(svg, r#"<text x="{left:.0}" y="{y:.0}">{}</text>"#, escape(line));
    }
}

/// Cores that glow with the tick's synaptic operations.
fn chip(svg: &mut String, replay: &Replay, tick: &ReplayTick, [left, top]: [f64; 2]) {
    let Some(plan) = &replay.chip else { return };
    let busy = &tick.cores[..tick.cores.len().min(plan.utilization.len())];
    let title = "cores by layer, brighter with more synaptic operations in this tick";
    let _ = write!(svg, r#"<text x="{left:.0}" y="{:.0}">{title}</text>"#, top - 14.0);
    glowing_cores(svg, plan, [left as u32, top as u32], busy);
}

/// Spikes of the whole episode with a line at the tick, layer below layer.
fn raster(
    svg: &mut String,
    replay: &Replay,
    episode: &Episode,
    tick: usize,
    [left, top, width]: [f64; 3],
) {
    let [_, rows] = replay.raster_size();
    let Some(png) = raster_png(replay, episode) else { return };
    let y = top - 10.0;
    let _ = write!(svg, r#"<text x="{left:.0}" y="{y:.0}">spikes of the whole trial</text>"#);
    let _ = write!(
        svg,
        r#"<image x="{:.0}" y="{top:.0}" width="{:.0}" height="{RASTER_PX}" preserveAspectRatio="none" href="data:image/png;base64,{}"/>"#,
        left + 110.0,
        width - 110.0,
        codec::to_base64(&png)
    );
    // Names of small layers are pushed apart.
    let (mut above, mut free) = (0, 0.0);
    for layer in replay.kept_layers() {
        let middle = f64::from(above) + f64::from(layer.neurons) / 2.0;
        let y = (top + RASTER_PX * middle / f64::from(rows)).max(free);
        free = y + 10.0;
        let name = escape(&layer.name);
        let _ =
            write!(svg, r#"<text x="{left:.0}" y="{:.1}" font-size="10">{name}</text>"#, y + 3.0);
        above += layer.neurons;
    }
    let share = (tick as f64 + 0.5) / episode.ticks.len().max(1) as f64;
    let x = left + 110.0 + (width - 110.0) * share;
    let _ = write!(
        svg,
        r##"<line x1="{x:.1}" y1="{top:.0}" x2="{x:.1}" y2="{:.0}" stroke="#d62728"/>"##,
        top + RASTER_PX
    );
}

/// Steps to the right, neurons downwards: a pixel for each; `None` without spikes to show.
fn raster_png(replay: &Replay, episode: &Episode) -> Option<Vec<u8>> {
    let [steps, height] = replay.raster_size();
    let width = steps * episode.ticks.len() as u32;
    if width == 0 || height == 0 {
        return None;
    }
    let row_bytes = width.div_ceil(8) as usize;
    let mut bits = vec![0u8; row_bytes * height as usize];
    for (tick, at) in episode.ticks.iter().enumerate() {
        for place in &at.spikes {
            let (step, neuron) = place_of(replay, *place);
            let x = tick * steps as usize + step as usize;
            bits[row_bytes * neuron as usize + x / 8] |= 0x80 >> (x % 8);
        }
    }
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_palette([[0; 3], SPIKE_RGB].concat());
    encoder.set_trns(vec![0, 255]);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&bits).ok()?;
    writer.finish().ok()?;
    Some(png)
}

/// Step and row of a bit of [`ReplayTick::spikes`].
fn place_of(replay: &Replay, place: u32) -> (u32, u32) {
    let (mut left, mut row) = (place, 0);
    for layer in replay.kept_layers() {
        let bits = layer.steps * layer.neurons;
        if left < bits {
            return (left / layer.neurons, row + left % layer.neurons);
        }
        left -= bits;
        row += layer.neurons;
    }
    panic!("bit {place} of {} was checked", replay.spike_bits())
}
