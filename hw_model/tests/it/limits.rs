//! Every limit of a chip, a core and a register: as much as fits is accepted, one more is refused
//! with the place, the number, the limit and what to do.

use hw_model::core_map::{AxonIn, AxonOut, CompartmentGroup, PortTarget};
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

pub(crate) fn changed(change: impl FnOnce(&mut CoreMapParts)) -> Result<CoreMap, MapError> {
    let mut parts = CoreMapParts::from_text("small", SMALL, ChipSpec::loihi1()).unwrap();
    change(&mut parts);
    CoreMap::new(parts)
}

#[track_caller]
pub(crate) fn refused(change: impl FnOnce(&mut CoreMapParts), expected: &str) {
    assert_eq!(changed(change).expect_err("must be refused").to_string(), expected);
}

#[track_caller]
pub(crate) fn accepted(change: impl FnOnce(&mut CoreMapParts)) {
    if let Err(error) = changed(change) {
        panic!("must be accepted: {error}");
    }
}

fn format(sign_mode: SignMode, weight_bits: u8, exponent: i8) -> SynapseFormat {
    SynapseFormat { sign_mode, weight_bits, exponent }
}

pub(crate) fn dense(mantissas: &[i16]) -> SynapseEntry {
    SynapseEntry { format: 0, form: SynapseForm::Dense { first: 0, mantissas: mantissas.to_vec() } }
}

/// `count` groups of one compartment each after the first, changed by their number.
fn add_groups(parts: &mut CoreMapParts, count: u16, change: impl Fn(&mut CompartmentGroup, u16)) {
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
        parts.cores[0].lists = vec![SynapseList { entries: vec![dense(&[2])] }; words].into();
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
fn decays_and_refractory_periods_make_configurations_and_biases_do_not() {
    let distinct: [fn(&mut CompartmentGroup, u16); 3] = [
        |group, i| group.decay_current = i,
        |group, i| group.decay_voltage = i,
        |group, i| group.refractory_steps = 1 + i as u8,
    ];
    for change in distinct {
        let error = changed(|p| add_groups(p, 32, change)).unwrap_err().to_string();
        assert!(error.contains(": 33 compartment configurations, limit 32"), "{error}");
    }
    accepted(|p| add_groups(p, 100, |_, _| ()));
    accepted(|p| add_groups(p, 100, |group, i| group.bias_mantissa = i as i16));
    accepted(|p| add_groups(p, 100, |group, i| group.bias_exponent = i as u8 % 8));
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

#[test]
fn a_map_for_a_chip_that_cannot_be_is_refused() {
    refused(
        |p| p.chip.arithmetic.current_bits = 31,
        "chip: chip loihi1: arithmetic.current_bits = 31, must be 1..=30; correct the chip file; \
         the map is inconsistent",
    );
}
