//! What a run of the benches measured, as tables in Markdown.

use std::path::Path;
use std::time::SystemTime;

use pulp::Arch;
use serde_json::Value;

/// One bench as criterion left it.
struct Measured {
    group: String,
    /// Function and parameter.
    case: String,
    elements: Option<f64>,
    /// Median time of an iteration.
    seconds: f64,
    written: SystemTime,
}

impl Measured {
    fn per_second(&self) -> Option<f64> {
        self.elements.map(|elements| elements / self.seconds)
    }
}

/// Prints what `results` holds since `started`; nothing when that is nothing.
pub(crate) fn print(results: &Path, started: SystemTime) {
    let mut all = Vec::new();
    collect(results, started, &mut all);
    if all.is_empty() {
        return;
    }
    // In the order in which they ran.
    all.sort_by_key(|result| result.written);
    let groups: Vec<&[Measured]> = all.chunk_by(|a, b| a.group == b.group).collect();
    println!("# Speed\n");
    let vectors = format!("{:?}", Arch::new());
    let vectors = vectors.split('(').next().unwrap_or_default();
    println!("{}, {}, vectors of kind {vectors}", processor(), cores());
    print_beside_roofline(&groups);
    print_others(&groups);
}

fn processor() -> String {
    let about = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = about.lines().find_map(|line| line.strip_prefix("model name"));
    let name = name.map(|rest| rest.trim_start_matches([' ', '\t', ':']));
    name.unwrap_or(std::env::consts::ARCH).to_owned()
}

fn cores() -> String {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    format!("{cores} core{}", if cores == 1 { "" } else { "s" })
}

/// Reads every `new/estimates.json` below `folder` that is not older than `started`.
fn collect(folder: &Path, started: SystemTime, results: &mut Vec<Measured>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.file_name().is_some_and(|name| name == "new") {
            results.extend(read(&path, started));
        } else if path.is_dir() {
            collect(&path, started, results);
        }
    }
}

fn read(folder: &Path, started: SystemTime) -> Option<Measured> {
    let path = folder.join("estimates.json");
    let written = path.metadata().and_then(|about| about.modified()).ok()?;
    if written < started {
        return None;
    }
    let json = |name: &str| -> Option<Value> {
        serde_json::from_slice(&std::fs::read(folder.join(name)).ok()?).ok()
    };
    let (estimates, bench) = (json("estimates.json")?, json("benchmark.json")?);
    let words = ["function_id", "value_str"].map(|name| bench[name].as_str().unwrap_or(""));
    Some(Measured {
        group: bench["group_id"].as_str()?.to_owned(),
        case: words.join("/").trim_matches('/').to_owned(),
        elements: bench["throughput"]["Elements"].as_f64(),
        seconds: estimates["median"]["point_estimate"].as_f64()? * 1e-9,
        written,
    })
}

/// Groups that hold an engine and its roofline, thread count by thread count.
fn print_beside_roofline(groups: &[&[Measured]]) {
    let mut rows = Vec::new();
    for results in groups {
        let find = |case: String| results.iter().find(|r| r.case == case)?.per_second();
        for result in *results {
            let Some(threads) = result.case.strip_prefix("event/threads_") else { continue };
            let roofline = find(format!("roofline/threads_{threads}"));
            let (Some(engine), Some(roofline)) = (result.per_second(), roofline) else { continue };
            let millions = |per_second: f64| format!("{:.0}", per_second / 1e6);
            let percent = |part: f64| format!("{:.0} %", 100.0 * part);
            rows.push([
                result.group.clone(),
                threads.to_owned(),
                format!("{:.2}", result.elements.unwrap_or(0.0) / 1e6),
                format!("{:.2}", 1e3 * result.seconds),
                millions(engine),
                millions(roofline),
                percent(engine / roofline),
            ]);
        }
    }
    if rows.is_empty() {
        return;
    }
    println!("\nSynaptic events of a run, millions; events per second, millions; medians.\n");
    print_rows(
        [
            "network",
            "threads",
            "events",
            "engine, ms",
            "engine, /s",
            "roofline, /s",
            "engine / roofline",
        ],
        rows,
    );
}

fn print_others(groups: &[&[Measured]]) {
    let has_roofline =
        |results: &[Measured]| results.iter().any(|r| r.case.starts_with("roofline"));
    let others = groups.iter().filter(|results| !has_roofline(results)).copied().flatten();
    let row = |r: &Measured| {
        let rate = r.per_second().map_or("-".to_owned(), |n| format!("{:.3} M", n / 1e6));
        [format!("{}/{}", r.group, r.case), format!("{:.4}", 1e3 * r.seconds), rate]
    };
    let rows: Vec<[String; 3]> = others.map(row).collect();
    if !rows.is_empty() {
        println!("\nAll else; medians.\n");
        print_rows(["bench", "ms", "elements, /s"], rows);
    }
}

fn print_rows<const N: usize>(head: [&str; N], rows: Vec<[String; N]>) {
    println!("| {} |", head.join(" | "));
    println!("|---{}|", "|--:".repeat(N - 1));
    rows.iter().for_each(|row| println!("| {} |", row.join(" | ")));
}
