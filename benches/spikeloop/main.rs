//! Speed of the main steps, with a table at the end.
//!
//! | module | groups |
//! |---|---|
//! | [`chip`] | `chip/NETWORK`: the event engine in synaptic events per second, beside the [`roofline`] of the same events; `rate/PERCENT`, `state/CORESxCOMPARTMENTS`, `engines/mlp_100_steps` |
//! | [`controllers`] | `compile`, `decision`, `trial`, `flight`, `encoder`: what a user waits for |
//!
//! Networks are drawn from fixed streams or ship with the crate, so the benches need no file.
//! Machines are noisy: compare ratios within one run. `benches/speed.sh` runs the groups of
//! [`chip`] and prints the table alone.

use std::path::Path;
use std::time::SystemTime;

use criterion::Criterion;

mod chip;
mod controllers;
mod networks;
mod roofline;
mod table;

fn main() {
    let started = SystemTime::now();
    // Where cargo builds: `target/criterion`, unless it was told to build elsewhere.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is in a folder");
    let results = target.join("criterion");
    let mut criterion = Criterion::default().output_directory(&results).configure_from_args();
    chip::all(&mut criterion);
    controllers::all(&mut criterion);
    criterion.final_summary();
    table::print(&results, started);
}
