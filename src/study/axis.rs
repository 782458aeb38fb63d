//! What a study varies.

use super::Variant;

/// One thing that could differ, and the values that are tried. The first is that of the chip as it
/// is, unless the axis is of another policy.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// What is varied, for people.
    pub about: &'static str,
    /// The values, from that of the chip as it is away.
    values: &'static [u32],
    label: fn(u32) -> String,
    set: fn(&mut Variant, u32),
}

const WEIGHT_BITS: &[u32] = &[8, 7, 6, 5, 4, 3, 2];
const STATE_BITS: &[u32] = &[24, 20, 18, 17, 16, 14, 12];

/// All axes.
pub const AXES: [Axis; 11] = [
    Axis {
        name: "bits",
        about: "weight bits, to nearest",
        values: WEIGHT_BITS,
        label: plain,
        set: |variant, bits| quantize(variant, "nearest", bits),
    },
    Axis {
        name: "bits-mixed",
        about: "weight bits, mixed signs",
        values: WEIGHT_BITS,
        label: plain,
        set: |variant, bits| quantize(variant, "mixed", bits),
    },
    Axis {
        name: "bits-toward-zero",
        about: "weight bits, toward zero",
        values: WEIGHT_BITS,
        label: plain,
        set: |variant, bits| quantize(variant, "toward-zero", bits),
    },
    Axis {
        name: "bits-diffused",
        about: "weight bits, errors diffused",
        values: WEIGHT_BITS,
        label: plain,
        set: |variant, bits| quantize(variant, "diffused", bits),
    },
    Axis {
        name: "voltage",
        about: "bits of the voltage (24 on Loihi)",
        values: STATE_BITS,
        label: plain,
        set: |variant, bits| variant.voltage_bits = bits as u8,
    },
    Axis {
        name: "current",
        about: "bits of the current (24 on Loihi)",
        values: STATE_BITS,
        label: plain,
        set: |variant, bits| variant.current_bits = bits as u8,
    },
    Axis {
        name: "lost-spikes",
        about: "share of spike messages lost",
        values: &[0, 1_000, 10_000, 50_000, 100_000, 200_000],
        label: percent,
        set: |variant, share| variant.messages_lost_per_million = share,
    },
    Axis {
        name: "dead-synapses",
        about: "share of weights stuck at zero",
        values: &[0, 10_000, 50_000, 100_000, 200_000],
        label: percent,
        set: |variant, share| variant.dead_synapses_per_million = share,
    },
    Axis {
        name: "dead-cores",
        about: "dead cores, of those in use",
        values: &[0, 1, 2, 4, 8],
        label: plain,
        set: |variant, cores| variant.dead_cores = cores,
    },
    Axis {
        name: "neurons-per-core",
        about: "most neurons of a layer on a core",
        values: &[1024, 256, 128, 64, 32, 16, 8],
        label: plain,
        set: |variant, most| variant.neurons_per_core = (most < 1024).then_some(most as usize),
    },
    Axis {
        name: "cores",
        about: "cores asked for, shared out by work",
        values: &[0, 8, 16, 32, 64, 96, 128],
        label: |cores| if cores == 0 { "fewest".to_owned() } else { plain(cores) },
        set: |variant, cores| variant.cores = (cores > 0).then_some(cores as usize),
    },
];

impl Axis {
    /// The axis of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        AXES.iter().find(|axis| axis.name == name)
    }

    /// Label and variant of each value.
    pub fn variants(&self) -> impl Iterator<Item = (String, Variant)> + '_ {
        self.values.iter().map(|value| {
            let mut variant = Variant::default();
            (self.set)(&mut variant, *value);
            ((self.label)(*value), variant)
        })
    }
}

fn quantize(variant: &mut Variant, policy: &str, bits: u32) {
    variant.policy = policy.to_owned();
    variant.weight_bits = bits as u8;
}

fn plain(value: u32) -> String {
    value.to_string()
}

/// Millionths as percent.
fn percent(per_million: u32) -> String {
    format!("{} %", f64::from(per_million) / 1e4)
}
