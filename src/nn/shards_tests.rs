use super::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn shards_cover_the_batch_in_order_on_any_number_of_threads(
        batch in 1usize..40, count in 1usize..9, threads in 1usize..5,
    ) {
        let parts = Shards { count, threads }.run(batch, |range| range.collect::<Vec<_>>());
        prop_assert!(parts.iter().all(|part| !part.is_empty()));
        prop_assert_eq!(parts.concat(), (0..batch).collect::<Vec<_>>());
    }
}

#[test]
fn samples_are_taken_from_every_step() {
    // 2 steps, 3 samples, 2 features
    let all: Vec<f32> = (0..12).map(|i| i as f32).collect();
    assert_eq!(samples(&all, 3, 2, &(1..3)), [2.0, 3.0, 4.0, 5.0, 8.0, 9.0, 10.0, 11.0]);
}

#[test]
fn sum_adds_all_shards() {
    assert_eq!(sum(vec![vec![1.0, 2.0], vec![0.5, -1.0], vec![1.0, 1.0]]), [2.5, 2.0]);
}
