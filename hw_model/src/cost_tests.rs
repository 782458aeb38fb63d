use super::*;
use crate::spec::ChipSpec;

fn table(name: &str) -> CostTable {
    ChipSpec::loihi1().cost_table(name).expect("ships with the chip").clone()
}

#[test]
fn energy_is_counts_times_prices() {
    let counts = OpCounts {
        synaptic_ops_sparse: 1000,
        updates_inactive: 10,
        updates_active: 4,
        updates_spiking: 2,
        messages: 6,
        messages_within_tile: 3,
        hops_east_west: 5,
        hops_north_south: 7,
        ..OpCounts::default()
    };
    let davies = table("davies2018").energy(&counts);
    assert_eq!(davies.synapses_fj, 23_600_000);
    assert_eq!(davies.compartments_fj, 520_000 + 6 * 81_000);
    assert_eq!(davies.network_fj, 3 * 1_700 + 5 * 3_000 + 7 * 4_000);
    let sanafe = table("sanafe").energy(&counts);
    assert_eq!(sanafe.compartments_fj, 512_000 + 4 * 72_800 + 2 * 142_100);
    assert_eq!(sanafe.network_fj, 6 * 111_000 + 5 * 3_000 + 7 * 4_200);
}

#[test]
fn barrier_is_linear_between_the_published_points() {
    let sanafe = table("sanafe");
    assert_eq!(sanafe.barrier_ps(1), 600_000);
    assert_eq!(sanafe.barrier_ps(3), 1_200_000);
    assert_eq!(sanafe.barrier_ps(32), 1_800_000);
    assert_eq!(table("davies2018").barrier_ps(0), 113_000);
}
