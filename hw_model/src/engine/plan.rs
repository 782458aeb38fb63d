//! A core map laid out for execution: contiguous weights, and for each core where its spikes
//! come from.

use super::lanes::BLOCK;
use crate::compartment::CompartmentParams;
use crate::core_map::{CompartmentGroup, Core, CoreMap};
use crate::cost::{CoreTimes, CostTable};

mod fan;
mod links;
mod rows;

pub(super) use fan::{Fan, Fans, Pushed};
use links::all_links;
pub(super) use links::{Delivery, Link};
pub(super) use rows::{CHUNK, Fit, Pool, Rest, Row, Run, SECOND_FORM, Uniform};
use rows::{LaidOut, Layout, PoolWriter, Shapes};

/// Immutable part of an event engine.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) cores: Vec<CorePlan>,
    /// All weights of all rows.
    pub(super) weights: Pool,
    /// Compartments of each core, then lines of each port.
    pub(super) source_sizes: Vec<usize>,
    /// Messages per line of each port.
    pub(super) port_messages: Vec<Vec<u32>>,
    /// One for each cost table of the chip.
    pub(super) core_times: Vec<CoreTimes>,
    /// Synapses that are pushed by their source, of all cores.
    pub(super) fans: Fans,
}

/// What a compartment's update takes beside one synapse of an input axon, most of which have no
/// spike in most steps. Only the balance of threads depends on it.
const UPDATE_WORK: u64 = 50;

/// Work of a step, in synapses as for [`UPDATE_WORK`], from which on a thread pays off: some ten
/// microseconds, where two threads meet at the barrier in about one.
const THREAD_WORK: u64 = 2_000_000;

/// What one core needs to run.
#[derive(Debug)]
pub(super) struct CorePlan {
    pub(super) compartments: usize,
    /// Compartments that are updated together, in order.
    pub(super) blocks: Vec<Block>,
    /// Bias of every compartment, and zeros up to a whole block.
    pub(super) biases: Vec<i32>,
    pub(super) rows: Vec<Row>,
    pub(super) runs: Vec<Run>,
    /// All targets of the sparse rows.
    pub(super) targets: Vec<u16>,
    pub(super) fit: Fit,
    /// Weights and sums count in units of `64 << unit_shift`.
    pub(super) unit_shift: u32,
    /// The shape of all rows, where they have one.
    pub(super) uniform: Option<Uniform>,
    /// Number of sums: compartments and what padding needs.
    pub(super) sums: usize,
    pub(super) links: Vec<Link>,
    /// Deliveries of all links: most that can arrive in a step.
    pub(super) deliveries: usize,
    pub(super) sends: Sends,
    /// Synapses of all input axons.
    work: u64,
}

/// Compartments of equal parameters, but for their biases, within one word of spikes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) params: CompartmentParams,
    pub(super) start: usize,
    pub(super) len: usize,
    /// Whether nothing else lies in its word of spikes.
    pub(super) alone: bool,
}

/// Messages and hops of one spike.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SendCost {
    pub(super) messages: u32,
    pub(super) within_tile: u32,
    pub(super) east_west: u32,
    pub(super) north_south: u32,
}

impl SendCost {
    fn add(&mut self, cost: SendCost, times: u32) {
        self.messages += cost.messages * times;
        self.within_tile += cost.within_tile * times;
        self.east_west += cost.east_west * times;
        self.north_south += cost.north_south * times;
    }

    /// The same in 16 bits each, if they are enough.
    fn narrow(&self) -> Option<[u16; 4]> {
        let all = [self.messages, self.within_tile, self.east_west, self.north_south];
        let narrow = all.map(|n| n as u16);
        (narrow.map(u32::from) == all).then_some(narrow)
    }
}

impl From<[u32; 4]> for SendCost {
    fn from([messages, within_tile, east_west, north_south]: [u32; 4]) -> Self {
        Self { messages, within_tile, east_west, north_south }
    }
}

/// `work` on the cost of each spike in `words`.
#[inline(always)]
fn each<C: Copy>(words: impl Iterator<Item = u64>, costs: &[C], mut work: impl FnMut(C)) {
    for (mut word, costs) in words.zip(costs.chunks(BLOCK)) {
        while word != 0 {
            work(costs[word.trailing_zeros() as usize]);
            word &= word - 1;
        }
    }
}

/// What spikes of a core's compartments cost to send.
#[derive(Debug)]
pub(super) enum Sends {
    /// Each different cost, with a bit for every compartment that has it.
    Few(Vec<(SendCost, Vec<u64>)>),
    /// The cost of each compartment, in half the memory: most are fetched from afar.
    Narrow(Vec<[u16; 4]>),
    /// The cost of each compartment, where some are too large for that.
    Wide(Vec<SendCost>),
}

/// Most different costs for which going through all of them is faster than through the spikes.
const FEW: usize = 12;

impl Sends {
    fn new(of_each: Vec<SendCost>) -> Self {
        let mut costs = of_each.clone();
        costs.sort_unstable();
        costs.dedup();
        if costs.len() > FEW {
            let narrow: Option<_> = of_each.iter().map(|cost| cost.narrow()).collect();
            return narrow.map_or(Self::Wide(of_each), Self::Narrow);
        }
        let with_bits = |cost: SendCost| {
            let bits = |of_word: &[SendCost]| {
                let bit = |(i, there): (usize, &SendCost)| u64::from(*there == cost) << i;
                of_word.iter().enumerate().map(bit).sum::<u64>()
            };
            (cost, of_each.chunks(BLOCK).map(bits).collect())
        };
        // Sending nothing costs nothing.
        let costs = costs.into_iter().filter(|cost| *cost != SendCost::default());
        Self::Few(costs.map(with_bits).collect())
    }

    /// What the spikes in `words` cost, one bit for each compartment.
    #[inline(always)]
    pub(super) fn cost(&self, words: impl Iterator<Item = u64> + Clone) -> SendCost {
        let mut total = SendCost::default();
        match self {
            Self::Few(costs) => {
                for (cost, bits) in costs {
                    let mut times = 0;
                    for (word, bits) in words.clone().zip(bits) {
                        times += (word & bits).count_ones();
                    }
                    total.add(*cost, times);
                }
            }
            Self::Narrow(costs) => {
                each(words, costs, |cost| total.add(SendCost::from(cost.map(u32::from)), 1));
            }
            Self::Wide(costs) => each(words, costs, |cost| total.add(cost, 1)),
        }
        total
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Few(costs) => {
                let bytes =
                    |(_, bits): &(SendCost, Vec<u64>)| size_of::<SendCost>() + 8 * bits.len();
                costs.iter().map(bytes).sum()
            }
            Self::Narrow(costs) => size_of_val(&costs[..]),
            Self::Wide(costs) => size_of_val(&costs[..]),
        }
    }
}

impl Plan {
    pub(super) fn new(map: &CoreMap) -> Self {
        let core_sizes = map.cores().iter().map(Core::compartments);
        let port_sizes = map.ports().iter().map(|port| port.lines as usize);
        let source_sizes: Vec<usize> = core_sizes.chain(port_sizes).collect();
        let mut shapes = Shapes::default();
        let layouts: Vec<Layout> = map.cores().iter().map(|core| shapes.add(core)).collect();
        let (links, fan_edges) = all_links(map, &source_sizes, &layouts);
        let fans = Fans::new(map, &layouts, &source_sizes, fan_edges);
        let mut writer = PoolWriter::new(&shapes);
        let cores = layouts.iter().zip(links).enumerate();
        let cores = cores.map(|(id, (layout, mut links))| {
            let compartments = source_sizes[id];
            let laid_out = writer.lay_out(layout, &mut links, compartments);
            CorePlan::new(map, id, laid_out, links)
        });
        let cores = cores.collect();
        let weights = writer.into_pool();
        Self {
            cores,
            weights,
            port_messages: port_messages(map),
            core_times: map.chip().cost_tables.iter().map(CostTable::core_times).collect(),
            source_sizes,
            fans,
        }
    }

    /// Size in memory, everything that the threads and all engines of one map share.
    pub(super) fn bytes(&self) -> usize {
        self.cores.iter().map(CorePlan::bytes).sum::<usize>()
            + self.weights.bytes()
            + self.fans.bytes()
    }
}

/// Messages per line of each port.
fn port_messages(map: &CoreMap) -> Vec<Vec<u32>> {
    let messages = map.ports().iter().map(|port| {
        let mut messages = vec![0; port.lines as usize];
        port.targets.iter().for_each(|target| messages[target.line as usize] += 1);
        messages
    });
    messages.collect()
}

impl Plan {
    /// As many threads as have enough to do, at least one and at most `threads`.
    pub(super) fn threads_that_pay(&self, threads: usize) -> usize {
        let work: u64 = self.cores.iter().map(|core| core.work).sum();
        threads.min((work / THREAD_WORK) as usize).max(1)
    }

    /// Numbers of consecutive cores for at most `threads` threads, with about equal work.
    pub(super) fn shares(&self, threads: usize) -> Vec<usize> {
        let n = self.cores.len();
        let threads = threads.clamp(1, n.max(1));
        let mut sums = Vec::with_capacity(n);
        let total = self.cores.iter().fold(0, |sum, core| {
            sums.push(sum + core.work);
            sum + core.work
        });
        let mut first = 0;
        let share = |thread: usize| {
            let goal = total * thread as u64 / threads as u64;
            let end = sums.partition_point(|sum| *sum < goal) + 1;
            // At least one core each, for those that follow as well.
            let end = if thread == threads { n } else { end.max(first + 1) };
            let end = end.min(n - (threads - thread).min(n));
            let len = end - first;
            first = end;
            len
        };
        (1..=threads).map(share).collect()
    }
}

impl CorePlan {
    fn new(map: &CoreMap, id: usize, laid_out: LaidOut, links: Vec<Link>) -> Self {
        let core = &map.cores()[id];
        let compartments = core.compartments();
        let work = UPDATE_WORK * compartments as u64 + core.synapses();
        let mut biases: Vec<i32> =
            core.params(&map.chip().arithmetic).iter().map(|p| p.bias).collect();
        biases.resize(laid_out.sums, 0);
        Self {
            compartments,
            blocks: blocks(map, core),
            biases,
            rows: laid_out.rows,
            runs: laid_out.runs,
            targets: laid_out.targets,
            fit: laid_out.fit,
            unit_shift: laid_out.unit_shift,
            uniform: laid_out.uniform,
            sums: laid_out.sums,
            deliveries: links.iter().map(|link| link.deliveries.len()).sum(),
            links,
            sends: Sends::new(send_costs(map, id, core)),
            work,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
            + size_of_val(&self.biases[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.runs[..])
            + size_of_val(&self.targets[..])
            + self.links.iter().map(Link::bytes).sum::<usize>()
            + self.sends.bytes()
    }
}

/// Groups of equal parameters but for the bias, cut where a word of spikes ends.
fn blocks(map: &CoreMap, core: &Core) -> Vec<Block> {
    let arithmetic = &map.chip().arithmetic;
    let alike = |a: &CompartmentGroup, b: &CompartmentGroup| {
        let bias = (a.bias_mantissa, a.bias_exponent);
        let len = a.len;
        *a == CompartmentGroup { bias_mantissa: bias.0, bias_exponent: bias.1, len, ..*b }
    };
    let mut blocks = Vec::new();
    let mut start = 0;
    for groups in core.groups.chunk_by(alike) {
        let params = groups[0].params(arithmetic);
        let end = start + groups.iter().map(|group| usize::from(group.len)).sum::<usize>();
        while start < end {
            let len = (BLOCK - start % BLOCK).min(end - start);
            blocks.push(Block { params, start, len, alone: true });
            start += len;
        }
    }
    for index in 1..blocks.len() {
        if blocks[index - 1].start / BLOCK == blocks[index].start / BLOCK {
            blocks[index - 1].alone = false;
            blocks[index].alone = false;
        }
    }
    blocks
}

fn send_costs(map: &CoreMap, id: usize, core: &Core) -> Vec<SendCost> {
    let mesh = &map.chip().mesh;
    let (x, y) = mesh.tile(id as u16);
    let mut costs = vec![SendCost::default(); core.compartments()];
    for axon in &core.axons_out {
        let (to_x, to_y) = mesh.tile(axon.core.0);
        let cost = &mut costs[axon.compartment.index()];
        cost.messages += 1;
        cost.within_tile += u32::from((x, y) == (to_x, to_y));
        cost.east_west += u32::from(x.abs_diff(to_x));
        cost.north_south += u32::from(y.abs_diff(to_y));
    }
    costs
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
