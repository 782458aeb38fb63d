//! Every limit of a core map and every way in which its parts can contradict each other: one
//! more than fits is refused, with the place, the number, the limit and what to do.

use hw_model::core_map::{AxonIn, AxonOut, Population, PortTarget, Slice};
use hw_model::id::{AxonIdx, CompartmentIdx, CoreId};
use hw_model::synapse::{SynapseEntry, SynapseForm, SynapseList};
use hw_model::weight::{SignMode, SynapseFormat};
use hw_model::{ChipSpec, CoreMap, CoreMapParts, MapError};

/// Two cores: `fc` with three compartments, an input axon from the host and an output axon to the
/// one compartment of `out`.
const SMALL: &str = "\
chip loihi1
core 000 label fc
core 000 group cx=0000..0003 decay_u=2048 decay_v=1024 vth=233 bias=0<<0 refractory=1
core 000 format 0 mode=mixed bits=8 exp=0
core 000 list 0 entry format=0 dense first=0: -12 4 6
core 000 axon_in 0000 list=0 base=0
core 000 axon_out cx=0001 -> core 001 axon 0000
core 001 label out
core 001 group cx=0000..0001 decay_u=0 decay_v=0 vth=1 bias=0<<0 refractory=1
core 001 format 0 mode=mixed bits=8 exp=0
core 001 list 0 entry format=0 sparse: 0:8
core 001 axon_in 0000 list=0 base=0
population fc core=000 cx=0000..0003
population out core=001 cx=0000..0001
port in lines=4
port in line 3 -> core 000 axon 0000
";

fn changed(change: impl FnOnce(&mut CoreMapParts)) -> Result<CoreMap, MapError> {
    let mut parts = CoreMapParts::from_text("small", SMALL, ChipSpec::loihi1()).unwrap();
    change(&mut parts);
    CoreMap::new(parts)
}

#[track_caller]
fn refused(change: impl FnOnce(&mut CoreMapParts), expected: &str) {
    assert_eq!(changed(change).expect_err("must be refused").to_string(), expected);
}

#[track_caller]
fn accepted(change: impl FnOnce(&mut CoreMapParts)) {
    if let Err(error) = changed(change) {
        panic!("must be accepted: {error}");
    }
}

fn format(sign_mode: SignMode, weight_bits: u8, exponent: i8) -> SynapseFormat {
    SynapseFormat { sign_mode, weight_bits, exponent }
}

fn dense(mantissas: &[i16]) -> SynapseEntry {
    SynapseEntry { format: 0, form: SynapseForm::Dense { first: 0, mantissas: mantissas.to_vec() } }
}

/// `count` groups of one compartment each after the first, changed by their number.
fn add_groups(
    parts: &mut CoreMapParts,
    count: u16,
    change: impl Fn(&mut hw_model::core_map::CompartmentGroup, u16),
) {
    for index in 1..=count {
        let mut group = parts.cores[0].groups[0];
        group.len = 1;
        change(&mut group, index);
        parts.cores[0].groups.push(group);
    }
}

#[test]
fn the_unchanged_map_is_accepted() {
    accepted(|_| ());
}

// What a chip or a core has only so much of.

#[test]
fn a_129th_core_is_refused() {
    accepted(|p| p.cores.resize(128, Default::default()));
    refused(
        |p| p.cores.resize(129, Default::default()),
        "chip: 129 cores, limit 128 (loihi1.cores); \
         use a chip with more cores, fewer neurons, or more compartments per core",
    );
}

#[test]
fn core_with_1025_compartments_is_refused() {
    accepted(|p| p.cores[0].groups[0].len = 1024);
    refused(
        |p| p.cores[0].groups[0].len = 1025,
        "core 0 (fc): 1025 compartments, limit 1024 (loihi1.compartments_per_core); \
         put fewer neurons on a core",
    );
}

#[test]
fn core_with_4097_input_axons_is_refused() {
    accepted(|p| p.cores[0].axons_in.resize(4096, AxonIn { list: 0, base: 0 }));
    refused(
        |p| p.cores[0].axons_in.resize(4097, AxonIn { list: 0, base: 0 }),
        "core 0 (fc): 4097 input axons, limit 4096 (loihi1.input_axons_per_core); \
         split the target layer over more cores or reduce its fan-in",
    );
}

#[test]
fn core_with_4097_output_axons_is_refused() {
    let fill = |parts: &mut CoreMapParts, count: u16| {
        parts.cores[1].axons_in.resize(4096, AxonIn { list: 0, base: 0 });
        let axon = |i: u16| AxonOut {
            compartment: CompartmentIdx(i / 4096),
            core: CoreId(1),
            axon: AxonIdx(i % 4096),
        };
        parts.cores[0].axons_out = (0..count).map(axon).collect();
    };
    accepted(|p| fill(p, 4096));
    refused(
        |p| fill(p, 4097),
        "core 0 (fc): 4097 output axons, limit 4096 (loihi1.output_axons_per_core); \
         put fewer neurons on this core or more on each target core",
    );
}

#[test]
fn core_with_16385_memory_words_is_refused() {
    // A list of one synapse is one word: prefix 10, index 6, weight 8 bits.
    let fill = |parts: &mut CoreMapParts, words: usize| {
        parts.cores[0].lists = vec![SynapseList { entries: vec![dense(&[2])] }; words];
    };
    accepted(|p| fill(p, 16_384));
    refused(
        |p| fill(p, 16_385),
        "core 0 (fc): 16385 synapse memory words, limit 16384 (loihi1.synapse_words_per_core); \
         put fewer neurons on a core, use fewer weight bits, or prune",
    );
}

#[test]
fn core_with_8_synapse_formats_is_refused() {
    accepted(|p| p.cores[0].formats.resize(7, format(SignMode::Mixed, 8, 1)));
    refused(
        |p| p.cores[0].formats.resize(8, format(SignMode::Mixed, 8, 1)),
        "core 0 (fc): 8 synapse formats, limit 7 (loihi1.synapse_formats_per_core); \
         use fewer exponents or sign modes on this core",
    );
}

#[test]
fn core_with_33_compartment_configurations_is_refused() {
    accepted(|p| add_groups(p, 31, |group, i| group.decay_voltage = i));
    refused(
        |p| add_groups(p, 32, |group, i| group.decay_voltage = i),
        "core 0 (fc): 33 compartment configurations, limit 32 \
         (loihi1.compartment_configs_per_core); \
         place layers with different parameters on different cores",
    );
}

#[test]
fn every_parameter_but_the_threshold_makes_a_configuration() {
    let distinct: [fn(&mut hw_model::core_map::CompartmentGroup, u16); 5] = [
        |group, i| group.decay_current = i,
        |group, i| group.decay_voltage = i,
        |group, i| group.bias_mantissa = i as i16,
        // 8 exponents times 8 refractory periods.
        |group, i| (group.bias_exponent, group.refractory_steps) = (i as u8 % 8, 1 + i as u8 / 8),
        |group, i| group.refractory_steps = 1 + i as u8,
    ];
    for change in distinct {
        let error = changed(|p| add_groups(p, 32, change)).unwrap_err().to_string();
        assert!(error.contains(": 33 compartment configurations, limit 32"), "{error}");
    }
    accepted(|p| add_groups(p, 100, |_, _| ()));
}

#[test]
fn core_with_9_thresholds_is_refused() {
    accepted(|p| add_groups(p, 7, |group, i| group.threshold_mantissa = i.into()));
    refused(
        |p| add_groups(p, 8, |group, i| group.threshold_mantissa = i.into()),
        "core 0 (fc): 9 thresholds, limit 8 (loihi1.threshold_configs_per_core); \
         place layers with different thresholds on different cores",
    );
}

#[test]
fn more_than_65536_additions_per_compartment_are_refused() {
    // Two entries in one list: every message may add to a compartment twice.
    let fill = |parts: &mut CoreMapParts, lines: u32| {
        parts.cores[0].lists[0].entries.push(dense(&[2]));
        let (core, axon) = (CoreId(0), AxonIdx(0));
        parts.ports[0].lines = lines;
        parts.ports[0].targets = (0..lines).map(|line| PortTarget { line, core, axon }).collect();
    };
    accepted(|p| fill(p, 32_768));
    refused(
        |p| fill(p, 32_769),
        "core 0 (fc): 65538 possible additions per compartment and step, limit 65536; \
         the map is inconsistent",
    );
}

// What a register cannot hold.

#[test]
fn decays_above_4096_are_refused() {
    accepted(|p| p.cores[0].groups[0].decay_current = 4096);
    refused(
        |p| p.cores[0].groups[0].decay_current = 4097,
        "core 0 (fc), group 0: decay_current = 4097, must be 0..=4096; \
         decays are 4096ths lost per step",
    );
    refused(
        |p| p.cores[1].groups[0].decay_voltage = 4097,
        "core 1 (out), group 0: decay_voltage = 4097, must be 0..=4096; \
         decays are 4096ths lost per step",
    );
}

#[test]
fn a_threshold_of_zero_or_beyond_17_bits_is_refused() {
    let expected = |value: u32| {
        format!(
            "core 0 (fc), group 0: threshold mantissa = {value}, must be 1..=131071; \
             scale the layer's weights and threshold"
        )
    };
    accepted(|p| p.cores[0].groups[0].threshold_mantissa = 131_071);
    for value in [0, 131_072, u32::MAX] {
        refused(|p| p.cores[0].groups[0].threshold_mantissa = value, &expected(value));
    }
}

#[test]
fn a_bias_beyond_its_registers_is_refused() {
    accepted(|p| p.cores[0].groups[0].bias_mantissa = -4095);
    refused(
        |p| p.cores[0].groups[0].bias_mantissa = -4096,
        "core 0 (fc), group 0: bias mantissa = -4096, must be -4095..=4095; \
         raise the bias exponent",
    );
    accepted(|p| p.cores[0].groups[0].bias_exponent = 7);
    refused(
        |p| p.cores[0].groups[0].bias_exponent = 8,
        "core 0 (fc), group 0: bias exponent = 8, must be 0..=7; use a bias axon",
    );
}

#[test]
fn refractory_periods_of_0_and_64_steps_are_refused() {
    accepted(|p| p.cores[0].groups[0].refractory_steps = 63);
    for value in [0, 64] {
        refused(
            |p| p.cores[0].groups[0].refractory_steps = value,
            &format!(
                "core 0 (fc), group 0: refractory steps = {value}, must be 1..=63; \
                 1 means no refractory step"
            ),
        );
    }
}

#[test]
fn weight_exponents_beyond_their_register_are_refused() {
    accepted(|p| p.cores[0].formats[0].exponent = -8);
    accepted(|p| p.cores[0].formats[0].exponent = 7);
    for value in [-9, 8] {
        refused(
            |p| p.cores[0].formats[0].exponent = value,
            &format!(
                "core 0 (fc), synapse format 0: weight exponent = {value}, must be -8..=7; \
                 rescale the layer"
            ),
        );
    }
}

#[test]
fn weights_of_0_7_or_9_bits_are_refused() {
    for value in [0, 7, 9, 255] {
        refused(
            |p| p.cores[0].formats[0].weight_bits = value,
            &format!(
                "core 0 (fc), synapse format 0: weight bits = {value}, \
                 must be one of [1, 2, 3, 4, 5, 6, 8]; choose a width that the chip has"
            ),
        );
    }
}

#[test]
fn mantissas_off_the_grid_of_their_format_are_refused() {
    let cases = [
        (SignMode::Mixed, 8, 3, "-256..=254 in steps of 2 (Mixed, 8 bit)"),
        (SignMode::Mixed, 8, 256, "-256..=254 in steps of 2 (Mixed, 8 bit)"),
        (SignMode::Mixed, 6, 12, "-256..=248 in steps of 8 (Mixed, 6 bit)"),
        (SignMode::Excitatory, 8, -1, "0..=255 in steps of 1 (Excitatory, 8 bit)"),
        (SignMode::Excitatory, 8, 256, "0..=255 in steps of 1 (Excitatory, 8 bit)"),
        (SignMode::Inhibitory, 6, -6, "-252..=0 in steps of 4 (Inhibitory, 6 bit)"),
    ];
    for (sign_mode, bits, mantissa, limit) in cases {
        refused(
            |p| {
                p.cores[1].formats[0] = format(sign_mode, bits, 0);
                p.cores[1].lists[0].entries = vec![dense(&[mantissa])];
            },
            &format!(
                "core 1 (out), synapse list 0: weight mantissa = {mantissa}, must be {limit}; \
                 round it by a named policy first"
            ),
        );
    }
}

// What refers to nothing.

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
fn a_map_for_a_chip_that_cannot_be_is_refused() {
    refused(
        |p| p.chip.arithmetic.current_bits = 31,
        "chip: chip loihi1: arithmetic.current_bits = 31, must be 1..=30; correct the chip file; \
         the map is inconsistent",
    );
}
