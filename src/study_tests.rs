use super::*;
use crate::net::{Controller, builtin};

fn laser_only() -> Controller {
    builtin::open("laser-only", None).expect("it comes built in")
}

#[test]
fn every_axis_starts_at_the_chip_as_it_is_or_at_eight_bits() {
    for axis in &AXES {
        let variants: Vec<(String, Variant)> = axis.variants().collect();
        let first = &variants[0].1;
        let eight = Variant { policy: first.policy.clone(), ..Variant::default() };
        assert_eq!(*first, eight, "{}", axis.name);
        for (index, (label, variant)) in variants.iter().enumerate() {
            assert!(variants[..index].iter().all(|other| other.0 != *label && other.1 != *variant));
        }
    }
    let names: std::collections::BTreeSet<_> = AXES.iter().map(|axis| axis.name).collect();
    assert_eq!(names.len(), AXES.len());
    assert_eq!(Axis::named("lost-spikes").unwrap().variants().nth(1).unwrap().0, "0.1 %");
    assert!(Axis::named("colour").is_none());
}

#[test]
fn fewer_bits_take_less_memory_and_seven_are_not_there() {
    let network = laser_only();
    let words = |weight_bits| {
        let deployment = Variant { weight_bits, ..Variant::default() }.compile(&network)?;
        Ok(deployment.map.utilization().iter().map(|core| core.synapse_words.used).sum::<u64>())
    };
    let of: Vec<Result<u64, VariantError>> = (2..=8).map(words).collect();
    let error = of[5].as_ref().unwrap_err().to_string();
    assert!(error.contains("weight bits = 7, must be one of [1, 2, 3, 4, 5, 6, 8]"), "{error}");
    let known: Vec<u64> = of.into_iter().filter_map(Result::ok).collect();
    assert_eq!(known.len(), 6);
    assert!(known.is_sorted_by(|a, b| a < b), "{known:?}");
}

#[test]
fn a_voltage_too_narrow_for_a_threshold_says_so() {
    let narrow = Variant { voltage_bits: 12, ..Variant::default() };
    let error = narrow.compile(&laser_only()).unwrap_err().to_string();
    assert!(error.starts_with("layer "), "{error}");
    assert!(
        error.contains(
            "must be 1..=31; it is too large beside the weights for the chip's registers"
        ),
        "{error}"
    );
    let none = Variant { voltage_bits: 2, ..Variant::default() };
    let error = none.compile(&laser_only()).unwrap_err().to_string();
    assert!(error.contains("arithmetic.threshold_mantissa_bits = 0"), "{error}");
    let zero_bits = Variant { weight_bits: 1, ..Variant::default() };
    let error = zero_bits.compile(&laser_only()).unwrap_err().to_string();
    assert_eq!(error, "weight bits = 1, must be 2..=8; choose a width between");
}

#[test]
fn damage_that_the_map_has_no_room_for_is_refused() {
    let deployment = Variant::default().compile(&laser_only()).unwrap();
    let used = deployment.map.cores().len();
    let broken = Variant { dead_cores: 100, ..Variant::default() };
    let error = broken.driver(deployment.clone()).unwrap_err().to_string();
    assert_eq!(error, format!("100 dead cores, but {used} in use; take fewer"));
    let broken = Variant { dead_synapses_per_million: 1_000_001, ..Variant::default() };
    let error = broken.driver(deployment).unwrap_err().to_string();
    assert!(error.starts_with("faults: dead synapses = 1000001 per million"), "{error}");
    assert_eq!(broken.undamaged(), Variant::default());
}

#[test]
fn fewer_neurons_on_a_core_take_more_cores_until_the_chip_is_full() {
    let cores = |network: &Controller, most| {
        let variant = Variant { neurons_per_core: most, ..Variant::default() };
        variant.compile(network).map(|deployment| deployment.map.core_usage().used)
    };
    let network = laser_only();
    let axis = Axis::named("neurons-per-core").unwrap();
    let of: Vec<u64> = axis
        .variants()
        .map(|(_, variant)| cores(&network, variant.neurons_per_core).unwrap())
        .collect();
    assert!(of.is_sorted() && of[0] < 8 && of[6] > 96, "{of:?}");
    let big = builtin::open("eem-san", None).unwrap();
    let error = cores(&big, Some(64)).unwrap_err().to_string();
    assert!(error.contains("128"), "{error}");
    // Asked for, cores are taken, and the fewest are the first value.
    let asked = Axis::named("cores").unwrap().variants();
    let used = |variant: Variant| variant.compile(&network).unwrap().map.core_usage().used;
    let taken: Vec<(String, u64)> = asked.map(|(label, variant)| (label, used(variant))).collect();
    assert_eq!((taken[0].0.as_str(), taken[0].1), ("fewest", of[0]));
    let within = |(label, taken): &(String, u64)| *taken <= label.parse::<u64>().unwrap();
    assert!(taken[1..].iter().all(within), "{taken:?}");
    assert!(taken.is_sorted_by(|a, b| a.1 < b.1), "{taken:?}");
    // Files of studies from before there were these axes.
    let old = serde_json::to_value(Variant::default()).unwrap();
    assert!(old.get("neurons_per_core").or(old.get("cores")).is_none());
    assert_eq!(serde_json::from_value::<Variant>(old).unwrap(), Variant::default());
}
