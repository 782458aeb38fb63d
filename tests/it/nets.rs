//! The integer networks with golden spikes, through every engine and thread count.

use std::sync::Arc;

use hw_model::engine::{Engine, PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::{ChipSpec, CoreMap, DenseEngine, EventEngine, OpCounts};
use spikeloop::compile::Split;
use spikeloop::host::Deployment;
use spikeloop::net::integer;
use spikeloop::npz::Npz;

use crate::fixtures::shared;

fn pairs(npz: &mut Npz, name: &str) -> PopulationSpikes {
    let steps = npz.ints(&format!("{name}_t")).unwrap().values;
    let lines = npz.ints(&format!("{name}_i")).unwrap().values;
    steps.into_iter().zip(lines).map(|(t, i)| (t as u64, i as u32)).collect()
}

/// A network of `nets/` on the chip, with its inputs and the spikes that it must give.
struct GoldenNet {
    map: Arc<CoreMap>,
    inputs: PopulationSpikes,
    golden: Vec<PopulationSpikes>,
}

impl GoldenNet {
    fn read(name: &str, split: Split) -> Option<Self> {
        let json = shared(&format!("nets/{name}.json"))?;
        let net = integer::read(&json, None).unwrap();
        let deployment = Deployment::of_integers(net, &ChipSpec::loihi1(), split);
        let map = deployment.unwrap().map;
        let inputs = pairs(&mut Npz::open(&json.with_extension("npz")).unwrap(), "in");
        let golden = json.with_file_name(format!("golden_{name}.npz"));
        let mut golden = Npz::open(&golden).unwrap();
        let golden = map.populations().iter().map(|p| pairs(&mut golden, &p.name)).collect();
        Some(Self { map, inputs, golden })
    }

    fn event(&self, threads: usize) -> Box<dyn Engine> {
        Box::new(EventEngine::with_threads(Arc::clone(&self.map), threads))
    }

    fn dense(&self) -> Box<dyn Engine> {
        Box::new(DenseEngine::new(Arc::clone(&self.map)))
    }

    /// Counts after `steps` steps, whose spikes must be the golden ones.
    #[track_caller]
    fn check(&self, mut engine: Box<dyn Engine>, steps: usize, what: &str) -> OpCounts {
        let map = &self.map;
        let spikes = self.inputs.iter().map(|(step, line)| (*step, 0, *line));
        let stimulus = Stimulus::new(map, steps, spikes).unwrap();
        let mut record = SpikeRecord::all(map);
        engine.run(&stimulus, &mut record);
        for (population, (got, golden)) in
            map.populations().iter().zip(record.by_population(map).iter().zip(&self.golden))
        {
            let expected = &golden[..golden.partition_point(|spike| spike.0 < steps as u64)];
            assert!(got == expected, "{what}: spikes of {} differ", population.name);
        }
        engine.total_counts()
    }
}

#[test]
fn mlp_spikes_equal_the_golden_ones_by_every_engine_and_thread_count() {
    // Small cores, so that there is something to share between threads.
    let Some(net) = GoldenNet::read("mlp", Split::NeuronsPerCore(64)) else { return };
    let engines = [net.event(1), net.event(2), net.event(3), net.dense()];
    for (index, engine) in engines.into_iter().enumerate() {
        let what = format!("engine {index}");
        let counts = net.check(engine, 5000, &what);
        assert_eq!(counts.synaptic_ops(), 107_030_374, "{what}");
    }
}

#[test]
fn conv_spikes_equal_the_golden_ones_by_every_engine_and_thread_count() {
    let Some(net) = GoldenNet::read("conv", Split::Fewest) else { return };
    let first = net.check(net.event(1), 100, "event engine");
    // The last kernel has three zeros, which are not stored where a sparse list is smaller: 334
    // operations less than there are synaptic events.
    assert_eq!(first.synaptic_ops(), 112_073_020 - 334);
    for threads in [2, 3] {
        let what = format!("event engine, {threads} threads");
        assert_eq!(net.check(net.event(threads), 100, &what), first, "{what}");
    }
    assert_eq!(net.check(net.dense(), 100, "dense engine"), first);
}
