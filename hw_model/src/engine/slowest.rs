//! Which core a step waits for.

/// The slowest core of a step by one cost table; of cores equally slow the first. Until a core has
/// taken any time there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Slowest {
    /// How long it took.
    pub(super) ps: u64,
    /// Number of the core.
    pub(super) core: u16,
}

impl Slowest {
    /// Another core, of a higher number than those before, took `ps`.
    #[inline(always)]
    pub(super) fn see(&mut self, core: usize, ps: u64) {
        if ps > self.ps {
            *self = Self { ps, core: core as u16 };
        }
    }
}

/// Time of the chip so far, in picoseconds, one value for each cost table.
#[derive(Debug, Clone)]
pub(super) struct ChipTime {
    /// Slowest cores and barriers, step after step.
    pub(super) total_ps: Vec<u64>,
    /// The part of it in which each core was the slowest, [cores, tables].
    pub(super) slowest_ps: Vec<u64>,
    barriers_ps: Vec<u64>,
}

impl ChipTime {
    /// Before the first step of a map with so many cores.
    pub(super) fn new(cores: usize, barriers_ps: Vec<u64>) -> Self {
        let tables = barriers_ps.len();
        Self { total_ps: vec![0; tables], slowest_ps: vec![0; cores * tables], barriers_ps }
    }

    /// A step whose slowest core by each table was this one.
    pub(super) fn add(&mut self, slowest: &[Slowest]) {
        let tables = self.barriers_ps.len();
        for (table, (slowest, barrier)) in slowest.iter().zip(&self.barriers_ps).enumerate() {
            self.total_ps[table] += slowest.ps + barrier;
            if let Some(core) = self.slowest_ps.get_mut(usize::from(slowest.core) * tables + table)
            {
                *core += slowest.ps;
            }
        }
    }
}
