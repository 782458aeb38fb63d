//! Every way in which the parts of a core map, or the input for it, can refer to nothing or
//! contradict each other.

use hw_model::core_map::{AxonOut, Population, PortTarget, Slice};
use hw_model::engine::Stimulus;
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::SynapseForm;
use hw_model::{CoreMapParts, MapError};

use crate::limits::{accepted, changed, refused};

#[test]
fn a_missing_synapse_format_is_refused() {
    refused(
        |p| p.cores[0].lists[0].entries[0].format = 1,
        "core 0 (fc), synapse list 0: refers to synapse format 1, but there are 1; \
         the map is inconsistent",
    );
}

#[test]
fn a_missing_synapse_list_is_refused() {
    refused(
        |p| p.cores[0].axons_in[0].list = 1,
        "core 0 (fc), input axon 0: refers to synapse list 1, but there are 1; \
         the map is inconsistent",
    );
}

#[test]
fn a_list_that_reaches_beyond_the_compartments_is_refused() {
    refused(
        |p| p.cores[0].axons_in[0].base = 1,
        "core 0 (fc), input axon 0: refers to compartment 3, but there are 3; \
         the map is inconsistent",
    );
    refused(
        |p| {
            let (targets, mantissas) = (vec![0, 1], vec![2, 2]);
            p.cores[1].lists[0].entries[0].form = SynapseForm::Sparse { targets, mantissas };
        },
        "core 1 (out), input axon 0: refers to compartment 1, but there are 1; \
         the map is inconsistent",
    );
}

#[test]
fn output_axons_to_or_from_nowhere_are_refused() {
    let start = "core 0 (fc), output axons: refers to";
    let end = "the map is inconsistent";
    refused(
        |p| p.cores[0].axons_out[0].compartment = CompartmentIdx(3),
        &format!("{start} compartment 3, but there are 3; {end}"),
    );
    refused(
        |p| p.cores[0].axons_out[0].core = CoreId(2),
        &format!("{start} core 2, but there are 2; {end}"),
    );
    refused(
        |p| p.cores[0].axons_out[0].axon = AxonIdx(1),
        &format!("{start} input axon of the target core 1, but there are 1; {end}"),
    );
}

#[test]
fn port_targets_that_lead_nowhere_are_refused() {
    let end = "the map is inconsistent";
    refused(
        |p| p.ports[0].targets[0].line = 4,
        &format!("port in: refers to line 4, but there are 4; {end}"),
    );
    refused(
        |p| p.ports[0].targets[0].core = CoreId(2),
        &format!("port in: refers to core 2, but there are 2; {end}"),
    );
    refused(
        |p| p.ports[0].targets[0].axon = AxonIdx(1),
        &format!("port in: refers to input axon of the target core 1, but there are 1; {end}"),
    );
}

#[test]
fn population_slices_outside_of_the_map_are_refused() {
    let end = "the map is inconsistent";
    refused(
        |p| p.populations[0].slices[0].core = CoreId(2),
        &format!("population fc: refers to core 2, but there are 2; {end}"),
    );
    refused(
        |p| p.populations[0].slices[0].len = 4,
        &format!("population fc: refers to compartment 3, but there are 3; {end}"),
    );
    refused(
        |p| p.populations[0].slices[0].first = CompartmentIdx(u16::MAX),
        &format!("population fc: refers to compartment 65537, but there are 3; {end}"),
    );
}

// What contradicts itself.

#[test]
fn sparse_targets_out_of_order_or_without_weights_are_refused() {
    let sparse = |p: &mut CoreMapParts, targets: &[u16], mantissas: &[i16]| {
        let (targets, mantissas) = (targets.to_vec(), mantissas.to_vec());
        p.cores[0].lists[0].entries[0].form = SynapseForm::Sparse { targets, mantissas };
    };
    accepted(|p| sparse(p, &[0, 2], &[2, 2]));
    for targets in [[2, 0], [1, 1]] {
        refused(
            |p| sparse(p, &targets, &[2, 2]),
            "core 0 (fc), synapse list 0: targets do not increase strictly; \
             the map is inconsistent",
        );
    }
    refused(
        |p| sparse(p, &[0, 1], &[2]),
        "core 0 (fc), synapse list 0: 2 targets but 1 weights; the map is inconsistent",
    );
}

#[test]
fn output_axons_out_of_order_or_repeated_are_refused() {
    let expected = "core 0 (fc), output axons: not sorted by compartment and target, or repeated; \
                    the map is inconsistent";
    let add = |p: &mut CoreMapParts, compartment| {
        let compartment = CompartmentIdx(compartment);
        p.cores[0].axons_out.push(AxonOut { compartment, core: CoreId(1), axon: AxonIdx(0) });
    };
    accepted(|p| add(p, 2));
    refused(|p| add(p, 0), expected);
    refused(|p| add(p, 1), expected);
}

#[test]
fn port_targets_out_of_order_or_repeated_are_refused() {
    let expected = "port in: targets not sorted, or repeated; the map is inconsistent";
    let add = |p: &mut CoreMapParts, line| {
        p.ports[0].targets.push(PortTarget { line, core: CoreId(1), axon: AxonIdx(0) });
    };
    accepted(|p| add(p, 3));
    refused(|p| add(p, 0), expected);
    refused(|p| [3, 3].into_iter().for_each(|line| add(p, line)), expected);
}

#[test]
fn a_port_of_more_than_2_to_the_24_lines_is_refused() {
    accepted(|p| p.ports[0].lines = 1 << 24);
    refused(
        |p| p.ports[0].lines = (1 << 24) + 1,
        "port in: 16777217 lines, limit 16777216; the map is inconsistent",
    );
}

#[test]
fn populations_that_share_compartments_are_refused() {
    let slice = |core, first, len| Slice { core: CoreId(core), first: CompartmentIdx(first), len };
    refused(
        |p| p.populations[1].slices.push(slice(0, 2, 1)),
        "population out: shares compartments of core 0 with another; the map is inconsistent",
    );
    refused(
        |p| p.populations[1].slices.push(slice(1, 0, 1)),
        "population out: shares compartments of core 1 with another; the map is inconsistent",
    );
}

#[test]
fn two_populations_or_ports_of_one_name_are_refused() {
    refused(
        |p| p.populations.push(Population { name: "fc".to_owned(), slices: Vec::new() }),
        "population fc: there are two of this name; the map is inconsistent",
    );
    refused(
        |p| p.ports.push(p.ports[0].clone()),
        "port in: there are two of this name; the map is inconsistent",
    );
}

#[test]
fn names_that_the_text_form_cannot_hold_are_refused() {
    let end = "visible ASCII characters without ';'; rename it";
    accepted(|p| p.cores[0].label = String::new());
    accepted(|p| p.cores[0].label = "x".repeat(256));
    refused(
        |p| p.cores[1].label = "fc 1".to_owned(),
        &format!("core 1: label \"fc 1\", must be at most 256 {end}"),
    );
    refused(
        |p| p.populations[1].name = "a\nb".to_owned(),
        &format!("population 1: name \"a\\nb\", must be 1 to 256 {end}"),
    );
    refused(
        |p| p.ports[0].name = String::new(),
        &format!("port 0: name \"\", must be 1 to 256 {end}"),
    );
    refused(
        |p| p.chip.name = "a;b".to_owned(),
        &format!("chip: name \"a;b\", must be 1 to 256 {end}"),
    );
    for name in ["µ", &"x".repeat(257)] {
        let error = changed(|p| p.ports[0].name = name.to_owned()).unwrap_err();
        assert!(matches!(error, MapError::Name { .. }), "{error}");
    }
}

#[test]
fn input_for_lines_or_ports_that_are_not_there_is_refused() {
    let map = changed(|_| ()).unwrap();
    let error = |port, line| Stimulus::new(&map, 9, [(7, port, line)]).unwrap_err().to_string();
    assert_eq!(error(0, 4), "input spike at step 7: line 4 of port in, but it has 4 lines");
    assert_eq!(error(1, 0), "input spike at step 7: port 1, but the map has 1 ports");
}

#[test]
fn input_is_sorted_counted_once_and_cut_to_the_length_of_the_run() {
    let map = changed(|_| ()).unwrap();
    let spikes = [(2, 0, 3), (0, 0, 1), (2, 0, 0), (2, 0, 3), (5, 0, 2)];
    let stimulus = Stimulus::new(&map, 5, spikes).unwrap();
    assert_eq!((stimulus.steps(), stimulus.at(0)), (5, &[(0, 1)][..]));
    assert_eq!(stimulus.at(2), [(0, 0), (0, 3)]);
    assert_eq!((stimulus.at(1), stimulus.at(4)), (&[][..], &[][..]));
    let part = stimulus.part(1..3);
    assert_eq!((part.steps(), part.at(0), part.at(1)), (2, &[][..], stimulus.at(2)));
    assert_eq!(stimulus.part(5..5), Stimulus::silent(0));
}
