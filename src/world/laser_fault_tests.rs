use super::LaserFault;
use crate::policy::LASER_SECTORS;
use crate::rng::{Streams, stream};

fn degraded(fault: LaserFault, range_m: f64, tick: u64) -> [f64; LASER_SECTORS] {
    let mut laser_m = [range_m; LASER_SECTORS];
    fault.apply(&mut laser_m, &mut Streams::new(7, 0).at(stream::LASER_FAULT, tick));
    laser_m
}

#[test]
fn three_sectors_are_stuck_and_the_others_untouched() {
    for (fault, stuck) in [(LaserFault::Near, 0.2), (LaserFault::Far, 6.0)] {
        for (sector, range_m) in degraded(fault, 3.25, 0).into_iter().enumerate() {
            let expected = if [2, 8, 14].contains(&sector) { stuck } else { 3.25 };
            assert_eq!(range_m, expected, "{fault:?}, sector {sector}");
        }
    }
}

#[test]
fn noise_has_a_deviation_of_a_metre_and_stays_in_range() {
    let all: Vec<f64> = (0..500).flat_map(|tick| degraded(LaserFault::Noise, 3.1, tick)).collect();
    assert!(all.iter().all(|range_m| (0.2..=6.0).contains(range_m)));
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let variance = all.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / all.len() as f64;
    // The clips, 2.9 deviations away, take some thousandths.
    assert!((mean - 3.1).abs() < 0.04, "mean {mean}");
    assert!((variance.sqrt() - 1.0).abs() < 0.04, "deviation {}", variance.sqrt());
    assert_eq!(degraded(LaserFault::Noise, -5.0, 1), [0.2; LASER_SECTORS]);
    assert_eq!(degraded(LaserFault::Noise, 40.0, 1), [6.0; LASER_SECTORS]);
}
