//! The integer networks with golden spikes, through every engine and thread count.

use std::sync::Arc;

use hw_model::ChipSpec;
use hw_model::engine::{Engine, PopulationSpikes, SpikeRecord, Stimulus};
use hw_model::{DenseEngine, EventEngine};
use spikeloop::host::Deployment;
use spikeloop::net::integer;
use spikeloop::npz::Npz;

use crate::fixtures::shared;

fn pairs(npz: &mut Npz, name: &str) -> PopulationSpikes {
    let steps = npz.ints(&format!("{name}_t")).unwrap().values;
    let lines = npz.ints(&format!("{name}_i")).unwrap().values;
    steps.into_iter().zip(lines).map(|(t, i)| (t as u64, i as u32)).collect()
}

#[test]
fn mlp_spikes_equal_the_golden_ones_by_every_engine_and_thread_count() {
    let Some(json) = shared("nets/mlp.json") else { return };
    let net = integer::read(&json, None).unwrap();
    // Small cores, so that there is something to share between threads.
    let deployment = Deployment::of_integers(net, &ChipSpec::loihi1(), Some(64)).unwrap();
    let map = &deployment.map;
    let inputs = pairs(&mut Npz::open(&json.with_extension("npz")).unwrap(), "in");
    let spikes = inputs.into_iter().map(|(step, line)| (step, 0, line));
    let stimulus = Stimulus::new(map, 5000, spikes).unwrap();
    let mut golden = Npz::open(&json.with_file_name("golden_mlp.npz")).unwrap();
    let golden: Vec<PopulationSpikes> =
        map.populations().iter().map(|p| pairs(&mut golden, &p.name)).collect();
    let event = |threads| -> Box<dyn Engine> {
        Box::new(EventEngine::with_threads(Arc::clone(map), threads))
    };
    let engines = [event(1), event(2), event(3), Box::new(DenseEngine::new(Arc::clone(map)))];
    for (index, mut engine) in engines.into_iter().enumerate() {
        let mut record = SpikeRecord::all(map);
        engine.run(&stimulus, &mut record);
        for (population, (got, expected)) in
            map.populations().iter().zip(record.by_population(map).iter().zip(&golden))
        {
            assert!(got == expected, "engine {index}: spikes of {} differ", population.name);
        }
        assert_eq!(engine.total_counts().synaptic_ops(), 107_030_374, "engine {index}");
    }
}

#[test]
fn convolutions_are_refused_with_the_projection_named() {
    let Some(json) = shared("nets/conv.json") else { return };
    let error = integer::read(&json, None).unwrap_err().to_string();
    assert!(error.ends_with("projection in->c1: kind conv2d found, dense expected; shared convolution kernels are not compiled yet"), "{error}");
}
