//! For each core, where its spikes come from.

use super::rows::{Layout, ListIs};
use crate::core_map::CoreMap;
use crate::faults::Loss;

/// Spikes of one source (a core or a port) that reach a core.
#[derive(Debug)]
pub(in crate::engine) struct Link {
    pub(in crate::engine) source: usize,
    /// The core.
    pub(in crate::engine) target: usize,
    /// Whether all deliveries are of the core's uniform rows.
    pub(in crate::engine) uniform: bool,
    /// One bit for each unit of the source that has deliveries here.
    pub(in crate::engine) reaching: Vec<u64>,
    /// For each word of `reaching`, the number of units before it that have a bit.
    pub(in crate::engine) ranks: Vec<u32>,
    /// First delivery of each unit with a bit, and the end; empty when each has one alone.
    starts: Vec<u32>,
    pub(in crate::engine) deliveries: Vec<Delivery>,
    /// Input axon of each delivery.
    axons: Vec<u16>,
}

/// A spike on an input axon of a core.
#[derive(Debug, Clone, Copy)]
pub(in crate::engine) struct Delivery {
    /// Row to add; in a core of uniform rows the first chunk of its weights in the pool.
    pub(in crate::engine) at: u32,
    /// Added to every target.
    pub(in crate::engine) base: u16,
    /// Synaptic operations, in a core of uniform rows, with [`SECOND_FORM`](super::SECOND_FORM).
    pub(in crate::engine) ops: u16,
}

impl Delivery {
    /// Row in the lower half, base above it, operations on top: many are counted at once.
    #[inline(always)]
    pub(in crate::engine) fn packed(self) -> u64 {
        u64::from(self.at) | u64::from(self.base) << 32 | u64::from(self.ops) << 48
    }

    #[inline(always)]
    pub(in crate::engine) fn unpacked(packed: u64) -> Self {
        Self { at: packed as u32, base: (packed >> 32) as u16, ops: (packed >> 48) as u16 }
    }
}

/// An axon that its source pushes: unit (of all sources), core, axon.
pub(super) type FanEdge = (u32, u16, u16);

/// Unit of a source, target core and its input axon.
type Edge = (u32, u16, u16);

/// For each core the links from every source that reaches it, in source order; and the axons that
/// sources push.
pub(super) fn all_links(
    map: &CoreMap,
    source_sizes: &[usize],
    layouts: &[Layout],
) -> (Vec<Vec<Link>>, Vec<FanEdge>) {
    let mut all = All { links: map.cores().iter().map(|_| Vec::new()).collect(), fans: Vec::new() };
    let of_cores = map.cores().iter().map(|core| {
        let edge = |a: &crate::core_map::AxonOut| (u32::from(a.compartment.0), a.core.0, a.axon.0);
        core.axons_out.iter().map(edge).collect::<Vec<Edge>>()
    });
    let of_ports = map.ports().iter().map(|port| {
        port.targets.iter().map(|t| (t.line, t.core.0, t.axon.0)).collect::<Vec<Edge>>()
    });
    let mut first_unit = 0;
    for (source, edges) in of_cores.chain(of_ports).enumerate() {
        all.add(map, layouts, source, [first_unit, source_sizes[source]], edges);
        first_unit += source_sizes[source];
    }
    (all.links, all.fans)
}

struct All {
    links: Vec<Vec<Link>>,
    fans: Vec<FanEdge>,
}

impl All {
    /// Adds what `source` sends; its units are `size` from `first_unit` on.
    fn add(
        &mut self,
        map: &CoreMap,
        layouts: &[Layout],
        source: usize,
        [first_unit, size]: [usize; 2],
        mut edges: Vec<Edge>,
    ) {
        edges.sort_unstable_by_key(|(unit, core, axon)| (*core, *unit, *axon));
        for edges in edges.chunk_by(|a, b| a.1 == b.1) {
            let core = usize::from(edges[0].1);
            let mut link = Link::new(source, core, size.div_ceil(64));
            for (unit, _, axon) in edges {
                let about = map.cores()[core].axons_in[usize::from(*axon)];
                match layouts[core].lists[about.list as usize] {
                    ListIs::Unused => unreachable!("this axon uses it"),
                    ListIs::Fan(_) => {
                        self.fans.push((first_unit as u32 + unit, core as u16, *axon));
                    }
                    ListIs::Row { row, offset } => {
                        let (at, base) = (u32::from(row), about.base + offset);
                        link.add(*unit as usize, Delivery { at, base, ops: 0 }, *axon);
                    }
                }
            }
            self.links[core].extend(link.finished());
        }
    }
}

impl Link {
    fn new(source: usize, target: usize, words: usize) -> Self {
        Self {
            source,
            target,
            uniform: false,
            reaching: vec![0; words],
            ranks: Vec::new(),
            starts: Vec::new(),
            deliveries: Vec::new(),
            axons: Vec::new(),
        }
    }

    /// Adds a delivery of `unit`, which is none before the last.
    fn add(&mut self, unit: usize, delivery: Delivery, axon: u16) {
        let (word, bit) = (&mut self.reaching[unit / 64], 1 << (unit % 64));
        if *word & bit == 0 {
            self.starts.push(self.deliveries.len() as u32);
            *word |= bit;
        }
        self.deliveries.push(delivery);
        self.axons.push(axon);
    }

    /// Ready to be used; `None` when there is nothing to deliver.
    fn finished(mut self) -> Option<Self> {
        let ranks = self.reaching.iter().scan(0, |rank, word| {
            *rank += word.count_ones();
            Some(*rank - word.count_ones())
        });
        self.ranks = ranks.collect();
        if self.starts.len() == self.deliveries.len() {
            self.starts = Vec::new();
        } else {
            self.starts.push(self.deliveries.len() as u32);
        }
        (!self.deliveries.is_empty()).then_some(self)
    }

    /// One link for the deliveries of uniform rows, and one for the others.
    pub(super) fn split(mut self, is_uniform: impl Fn(u32) -> bool) -> Vec<Self> {
        let uniform = self.deliveries.iter().filter(|delivery| is_uniform(delivery.at)).count();
        if uniform == 0 || uniform == self.deliveries.len() {
            self.uniform = uniform > 0;
            return vec![self];
        }
        let new = || Self::new(self.source, self.target, self.reaching.len());
        let mut parts = [new(), new()];
        parts[1].uniform = true;
        for unit in 0..64 * self.reaching.len() {
            if self.reaching[unit / 64] >> (unit % 64) & 1 == 0 {
                continue;
            }
            for number in self.deliveries_of(unit) {
                let delivery = self.deliveries[number];
                let part = &mut parts[usize::from(is_uniform(delivery.at))];
                part.add(unit, delivery, self.axons[number]);
            }
        }
        parts.into_iter().filter_map(Self::finished).collect()
    }

    /// Numbers of the deliveries of a spike of `unit`, which has a bit in `reaching`.
    #[inline(always)]
    pub(in crate::engine) fn deliveries_of(&self, unit: usize) -> std::ops::Range<usize> {
        let below = self.reaching[unit / 64] & ((1 << (unit % 64)) - 1);
        let rank = (self.ranks[unit / 64] + below.count_ones()) as usize;
        match self.starts.get(rank..rank + 2) {
            Some(starts) => starts[0] as usize..starts[1] as usize,
            None => rank..rank + 1,
        }
    }

    /// Whether no unit has two deliveries, so that their numbers are the ranks.
    pub(in crate::engine) fn has_single_deliveries(&self) -> bool {
        self.starts.is_empty()
    }

    /// How many of the deliveries of `unit` are lost.
    pub(in crate::engine) fn lost(&self, loss: Loss, unit: usize) -> usize {
        self.deliveries_of(unit).filter(|delivery| self.loses(loss, unit, *delivery)).count()
    }

    /// Whether delivery number `delivery`, of a spike of `unit`, is lost.
    pub(in crate::engine) fn loses(&self, loss: Loss, unit: usize, delivery: usize) -> bool {
        loss.takes(self.source, unit, self.target, self.axons[delivery])
    }

    /// Size in memory.
    pub(in crate::engine) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.ranks[..])
            + size_of_val(&self.deliveries[..])
            + size_of_val(&self.axons[..])
            + size_of_val(&self.reaching[..])
    }
}
