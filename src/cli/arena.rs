//! `spikeloop arena`.

use std::path::Path;

use spikeloop::report::plot::arena_picture;
use spikeloop::report::results::ArenaPicture;
use spikeloop::world::World;
use spikeloop::world::arena::Arena;

use crate::cli::args::ArenaArgs;
use crate::cli::output::{self, check_outputs, header, say};
use crate::cli::{Failure, Verdict};

pub(super) fn run(args: &ArenaArgs) -> Result<Verdict, Failure> {
    check_outputs([&args.output], [Path::new(&args.arena)])?;
    let picture = ArenaPicture::new(&World::new(Arena::open(&args.arena)?));
    say(header(None, &[]))?;
    say(picture.caption())?;
    output::write(&args.output, arena_picture(&picture).as_bytes())?;
    Ok(Verdict::Good)
}
