use super::*;
use crate::compile::place::{LayerWork, Work, place, spread};
use crate::net::conv2d::{Conv2d, Shape};
use crate::net::integer::{self, IntegerPopulation, IntegerProjection};
use hw_model::{ChipSpec, CoreMap, OpCounts};

/// A picture of 2x4x4 from 6x6 pixels, three neurons behind it and beside it.
fn graph() -> IntegerGraph {
    let population = |name: &str, neurons| GraphPopulation {
        name: name.to_owned(),
        neurons,
        decay_current: 2048,
        decay_voltage: 1024,
        threshold_mantissa: 100,
        bias: BiasRegisters::default(),
    };
    let projection = |sources: Vec<Source>, target, mantissas| Projection {
        sources,
        first_source: 0,
        target,
        mantissas,
        signs: Signs::Mixed,
        weight_bits: 8,
        exponent: 0,
    };
    let conv = conv(6);
    IntegerGraph {
        name: "g".to_owned(),
        ports: vec![("in".to_owned(), 36)],
        populations: vec![population("pic", 32), population("a", 3), population("b", 3)],
        projections: vec![
            projection(vec![Source::Port(0)], 0, Mantissas::Conv(conv, vec![2; conv.n_weights()])),
            projection(vec![Source::Population(0)], 1, Mantissas::Dense(vec![4; 96])),
            projection(
                vec![Source::Population(1), Source::Population(2)],
                2,
                Mantissas::Dense(vec![6; 9]),
            ),
        ],
    }
}

fn conv(pixels: usize) -> Conv2d {
    let input = Shape { channels: 1, height: pixels, width: pixels };
    Conv2d::new(input, 2, [3, 3], 1, 0).unwrap()
}

#[track_caller]
fn refused(change: impl FnOnce(&mut IntegerGraph), expected: &str) {
    let mut changed = graph();
    change(&mut changed);
    let error = place(&changed, &ChipSpec::loihi1(), None).expect_err("must be refused");
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_sound_graph_has_the_shapes_of_its_convolutions() {
    let shapes = graph().shapes().unwrap();
    assert_eq!(shapes[0], Shape { channels: 2, height: 4, width: 4 });
    assert_eq!(shapes[1..], [Shape::flat(3), Shape::flat(3)]);
}

#[test]
fn parts_that_do_not_go_together_are_refused_with_the_place() {
    let dense = |n: usize| Mantissas::Dense(vec![2; n]);
    refused(
        |g| g.projections[1].mantissas = dense(95),
        "projection 1: 95 weights are no rows for 3 neurons; correct the network",
    );
    refused(
        |g| g.projections[1].mantissas = dense(99),
        "projection 1: takes units up to 33 of Population(0), it has 32; correct the network",
    );
    refused(
        |g| g.projections[1].first_source = usize::MAX,
        "projection 1: takes units up to 18446744073709551615 of Population(0), it has 32; \
         correct the network",
    );
    refused(
        |g| g.projections[1].target = 3,
        "projection 1: onto population 3, there are 3; correct the network",
    );
    refused(
        |g| g.projections[2].sources[1] = Source::Port(1),
        "projection 2: from Port(1), which is not there; correct the network",
    );
    refused(
        |g| g.projections[2].sources.clear(),
        "projection 2: has no source; correct the network",
    );
    refused(
        |g| g.projections[0].mantissas = Mantissas::Conv(conv(6), vec![2; 17]),
        "projection 0: 17 weights, the kernel has [2, 1, 3, 3]; correct the network",
    );
    refused(
        |g| g.projections[0].mantissas = Mantissas::Conv(conv(5), vec![2; 18]),
        "projection 0: gives 2x3x3, but pic has 32 neurons; correct the network",
    );
    refused(
        |g| g.populations[1].neurons = 0,
        "projection 1: 96 weights are no rows for 0 neurons; correct the network",
    );
}

#[test]
fn pictures_of_other_shapes_and_biases_for_no_channels_are_refused() {
    refused(
        |g| {
            let wide = Shape { channels: 1, height: 3, width: 18 };
            let other = Conv2d::new(wide, 2, [3, 3], 1, 0).unwrap();
            g.ports[0].1 = 54;
            let mut second = g.projections[0].clone();
            second.mantissas = Mantissas::Conv(other, vec![2; other.n_weights()]);
            g.projections.push(second);
        },
        "projection 3: gives 2x1x16, another gives 2x4x4; correct the network",
    );
    refused(
        |g| g.populations[0].bias.mantissas = vec![1; 3],
        "population pic: 3 biases for 32 neurons; give 1, one per channel or per neuron; \
         correct the network",
    );
    refused(
        |g| {
            g.projections.remove(1);
            g.projections.remove(1);
            g.populations[1].neurons = 0;
        },
        "population a: has no neurons; correct the network",
    );
}

#[test]
fn sizes_beyond_all_memory_are_refused_without_taking_it() {
    refused(
        |g| {
            g.projections.clear();
            g.populations[0].neurons = usize::MAX;
        },
        "layer pic: its 18446744073709551615 neurons need more cores than the limit of 128 \
         (loihi1.cores); make the layer smaller, allow more neurons per core, or use a chip with \
         more or larger cores",
    );
    refused(
        |g| g.ports[0].1 = 1 << 33,
        "port in: 4294967295 lines, limit 16777216; the map is inconsistent",
    );
}

#[test]
fn biases_stand_for_all_neurons_for_channels_or_for_one_each() {
    let of = |mantissas: Vec<i16>, neuron| BiasRegisters { mantissas, exponent: 3 }.of(neuron, 6);
    assert_eq!(of(vec![], 5), (0, 0));
    assert_eq!(of(vec![7], 5), (7, 3));
    assert_eq!((of(vec![7, 8], 2), of(vec![7, 8], 3)), ((7, 3), (8, 3)));
    assert_eq!(of(vec![1, 2, 3, 4, 5, 6], 4), (5, 3));
}

#[test]
fn sources_of_one_projection_share_axons_and_lists() {
    let map = place(&graph(), &ChipSpec::loihi1(), None).unwrap();
    let b = &map.cores()[2];
    assert_eq!((b.lists.len(), b.axons_in.len()), (3, 3));
    let targets = |core: usize| -> Vec<u16> {
        let out = map.cores()[core].axons_out.iter();
        out.filter(|axon| axon.core.0 == 2).map(|axon| axon.axon.0).collect()
    };
    assert_eq!((targets(1), targets(2)), (vec![0, 1, 2], vec![0, 1, 2]));
}

// Limits, one by one, on a chip whose cores have less.

#[track_caller]
fn refused_by(change: impl FnOnce(&mut ChipSpec), expected: &str) {
    let mut chip = ChipSpec::loihi1();
    change(&mut chip);
    let error = place(&graph(), &chip, None).expect_err("must be refused");
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_neuron_of_a_picture_that_no_core_can_hold_is_refused() {
    refused_by(
        |chip| chip.limits.input_axons_per_core = 8,
        "layer a: one neuron needs 32 input axons, limit 8 per core; \
         reduce the fan-in of the layer or prune whole inputs",
    );
    let mut picture = graph();
    picture.populations.truncate(1);
    picture.projections.truncate(1);
    let mut chip = ChipSpec::loihi1();
    chip.limits.input_axons_per_core = 8;
    assert_eq!(
        place(&picture, &chip, None).unwrap_err().to_string(),
        "layer pic: one neuron needs 9 input axons, limit 8 per core; \
         reduce the fan-in of the layer or prune whole inputs"
    );
    chip.limits.input_axons_per_core = 9;
    assert_eq!(place(&picture, &chip, None).unwrap().cores().len(), 16);
    chip.limits.synapse_words_per_core = 8;
    assert_eq!(
        place(&picture, &chip, None).unwrap_err().to_string(),
        "layer pic: one neuron needs 9 synapse memory words, limit 8 per core; \
         reduce the fan-in of the layer, prune, or use fewer weight bits (--weight-bits)"
    );
    chip.limits.synapse_words_per_core = 9;
    assert_eq!(place(&picture, &chip, None).unwrap().cores().len(), 16);
    chip.limits.cores = 15;
    assert_eq!(
        place(&picture, &chip, None).unwrap_err().to_string(),
        "layer pic: its 32 neurons need more cores than the limit of 15 (loihi1.cores); \
         make the layer smaller, allow more neurons per core, or use a chip with more or larger \
         cores"
    );
}

#[test]
fn the_neuron_that_is_too_large_is_one_in_the_middle_of_the_picture() {
    let mut padded = graph();
    let input = Shape { channels: 1, height: 6, width: 6 };
    let conv = Conv2d::new(input, 2, [3, 3], 1, 1).unwrap();
    padded.populations = vec![padded.populations[0].clone()];
    padded.populations[0].neurons = 72;
    padded.projections.truncate(1);
    padded.projections[0].mantissas = Mantissas::Conv(conv, vec![2; conv.n_weights()]);
    let mut chip = ChipSpec::loihi1();
    // A corner would fit.
    chip.limits.input_axons_per_core = 8;
    assert_eq!(
        place(&padded, &chip, None).unwrap_err().to_string(),
        "layer pic: one neuron needs 9 input axons, limit 8 per core; \
         reduce the fan-in of the layer or prune whole inputs"
    );
}

#[test]
fn output_axons_limit_how_many_neurons_of_a_picture_share_a_core() {
    let cores = |limit| {
        let mut chip = ChipSpec::loihi1();
        chip.limits.output_axons_per_core = limit;
        place(&graph(), &chip, None).map(|map| map.cores().len()).map_err(|e| e.to_string())
    };
    // Every neuron of the picture has one axon, every other one too.
    assert_eq!(cores(32), Ok(3));
    assert_eq!(cores(31), Ok(4));
    assert_eq!(cores(8), Ok(6));
    let picture = place(&graph(), &ChipSpec::loihi1(), Some(8)).unwrap();
    assert_eq!(picture.cores().len(), 6);
    assert_eq!(picture.cores()[0].label, "pic[c0..2,y0..2,x0..2]");
}

/// A network of populations without input: number of neurons and projections with one weight for all, or
/// for the first pair alone.
fn coupled(neurons: &[usize], projections: &[(usize, usize, bool)]) -> IntegerGraph {
    let population = |(index, neurons): (usize, &usize)| IntegerPopulation {
        name: format!("p{index}"),
        neurons: *neurons,
        threshold_mantissa: Some(10),
    };
    let projection = |(source, target, all): &(usize, usize, bool)| {
        let mut weights = vec![if *all { 4 } else { 0 }; neurons[*source] * neurons[*target]];
        weights[0] = 4;
        let weights = integer::Mantissas::Dense(weights);
        IntegerProjection { sources: vec![*source], target: *target, weights }
    };
    IntegerGraph::from(IntegerNet {
        name: "n".to_owned(),
        decay_current: 2048,
        decay_voltage: 1024,
        populations: neurons.iter().enumerate().map(population).collect(),
        projections: projections.iter().map(projection).collect(),
    })
}

#[test]
fn recurrent_populations_are_cut_until_their_axons_fit() {
    let mut chip = ChipSpec::loihi1();
    // Of eight neurons that reach all of themselves and one other, a core of L has L * (8 / L + 1) axons.
    let cores = |limit, chip: &mut ChipSpec| {
        chip.limits.output_axons_per_core = limit;
        let recurrent = coupled(&[8, 1], &[(0, 0, true), (0, 1, true)]);
        place(&recurrent, chip, None).map(|map| map.cores().len()).map_err(|e| e.to_string())
    };
    assert_eq!(cores(16, &mut chip), Ok(2));
    assert_eq!(cores(12, &mut chip), Ok(3));
    assert_eq!(cores(10, &mut chip), Ok(5));
    assert_eq!(cores(9, &mut chip), Ok(9));
    assert!(
        cores(8, &mut chip).unwrap_err().starts_with("layer p0: one neuron needs 9 output axons")
    );
    // The second reaches all of the first, which lies on two cores: only one neuron of it fits a core.
    chip.limits.compartments_per_core = 2;
    chip.limits.output_axons_per_core = 3;
    let map = place(&coupled(&[4, 4], &[(0, 1, false), (1, 0, true)]), &chip, None).unwrap();
    let on = |population: usize| map.populations()[population].cores().len();
    assert_eq!([on(0), on(1)], [2, 4]);
}

/// The picture works the most, then what it projects to.
fn work(fewest: CoreMap) -> Work {
    assert_eq!(fewest.cores().len(), 3);
    let of = |synaptic_ops_dense| LayerWork {
        counts: OpCounts { synaptic_ops_dense, ..OpCounts::default() },
        phase: 0,
    };
    Work { layers: vec![of(1000), of(300), of(10)], steps: 1 }
}

#[test]
fn asked_for_cores_are_taken_and_shared_out() {
    let cores = |cores| {
        let map = spread(&graph(), &ChipSpec::loihi1(), cores, work);
        map.map(|map| map.cores().iter().map(|core| core.label.clone()).collect::<Vec<_>>())
    };
    assert_eq!(cores(3).unwrap(), ["pic", "a", "b"]);
    let of = |labels: &[String], name| labels.iter().filter(|l| l.starts_with(name)).count();
    let ten = cores(10).unwrap();
    assert!(ten.len() <= 10 && of(&ten, "pic") > of(&ten, "a"), "{ten:?}");
    assert!(of(&ten, "a") > 1, "{ten:?}");
    let all = cores(128).unwrap();
    assert!(all.len() > ten.len() && of(&all, "a") == 3, "{all:?}");
    assert_eq!(
        cores(2).unwrap_err().to_string(),
        "3 cores needed, 2 asked for: pic 1 (32 neurons), a 1 (3 neurons), b 1 (3 neurons); \
         ask for 3 or more"
    );
    assert_eq!(
        cores(129).unwrap_err().to_string(),
        "129 cores are more than the limit of 128 (loihi1.cores); ask for at most that"
    );
}

#[test]
fn where_splitting_a_target_takes_more_cores_of_its_source_all_stay_within_the_number() {
    let mut chip = ChipSpec::loihi1();
    // Each neuron of the picture has an axon to each core of `a`.
    chip.limits.output_axons_per_core = 32;
    let fewest = place(&graph(), &chip, None).unwrap().cores().len();
    for cores in fewest..20 {
        let taken = spread(&graph(), &chip, cores, work).unwrap().cores().len();
        assert!((fewest..=cores).contains(&taken), "{taken} of {cores}");
    }
}
