use super::*;

#[test]
fn counts_become_rates_and_shares() {
    let mut activity = Activity::default();
    assert_eq!(activity.summary(), None);
    for step in 0..100_u64 {
        let events: Vec<Event> =
            (0..step).map(|i| Event { t_us: i + 1, y: 0, x: i as u8, on: i % 3 != 0 }).collect();
        activity.add(&EventFrame::of_events(&events), &events);
    }
    assert_eq!(activity.n_steps(), 100);
    let summary = activity.summary().unwrap();
    assert!((summary.time_s - 1.0).abs() < 1e-12);
    assert!((summary.events_per_s - 4950.0).abs() < 1e-9);
    assert!((summary.hz_per_px - 4950.0 / 16384.0).abs() < 1e-9);
    assert!((summary.active_percent_median - 100.0 * 50.0 / 16384.0).abs() < 1e-9);
    assert!((summary.active_percent_p95 - 100.0 * 94.0 / 16384.0).abs() < 1e-9);
    assert!((summary.on_per_off.unwrap() - 2.0).abs() < 0.1);
}

#[test]
fn without_off_events_there_is_no_ratio() {
    let mut activity = Activity::default();
    let on = Event { t_us: 1, y: 0, x: 0, on: true };
    activity.add(&EventFrame::of_events(&[on]), &[on]);
    assert_eq!(activity.summary().unwrap().on_per_off, None);
}
