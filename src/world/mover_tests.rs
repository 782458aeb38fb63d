use super::*;
use crate::world::test_data::mover;

#[test]
fn a_mover_goes_to_the_end_and_back() {
    let cart = mover("cart", [1.0, 1.0], [1.0, 3.0], 0.5);
    let y_m = |step| cart.position(step).y;
    assert_eq!(cart.position(0), Point2::new(1.0, 1.0));
    assert!((y_m(100) - 1.5).abs() < 1e-12);
    assert!((y_m(400) - 3.0).abs() < 1e-12);
    assert!((y_m(500) - 2.5).abs() < 1e-12);
    assert!((y_m(800) - 1.0).abs() < 1e-12);
    assert_eq!(cart.disc(500).radius_m(), 0.25);
}

#[test]
fn a_billion_steps_later_it_is_where_it_was() {
    let cart = mover("cart", [0.0, 0.0], [2.0, 0.0], 0.5);
    let period = 800;
    for step in [0, 1, 123, 399, 400, 401, 799] {
        let later = cart.position(1_000_000_000 * period + step);
        assert!((later - cart.position(step)).norm() < 1e-3, "step {step}: {later}");
        let soon = cart.position(1000 * period + step);
        assert!((soon - cart.position(step)).norm() < 1e-9, "step {step}: {soon}");
    }
}

#[test]
fn it_never_leaves_its_track_nor_exceeds_its_speed() {
    let cart = mover("cart", [-1.0, 2.0], [2.0, -2.0], 1.3);
    for step in 0..2000 {
        let (here, next) = (cart.position(step), cart.position(step + 1));
        let from_m = (here - cart.from()).norm();
        assert!((from_m + (here - cart.to()).norm() - 5.0).abs() < 1e-9);
        assert!((next - here).norm() < 0.013 + 1e-9);
    }
}

#[test]
fn refused_movers_say_what_is_wrong() {
    let refuse = |to: [f64; 2], speed_m_per_s| {
        let start = Disc::new(Point2::origin(), 0.25).unwrap();
        let made = Mover::new("m".to_owned(), start, Point2::from(to), speed_m_per_s, 1.0);
        made.unwrap_err().to_string()
    };
    assert_eq!(
        refuse([1.0, 0.0], 0.0),
        "speed 0 m/s, must be above 0 and at most 10 m/s (MOVER_SPEED_M_PER_S_MAX); a standing \
         cylinder is an obstacle"
    );
    assert!(refuse([1.0, 0.0], f64::NAN).starts_with("speed NaN m/s"));
    assert!(refuse([1.0, 0.0], 10.5).starts_with("speed 10.5 m/s"));
    assert_eq!(
        refuse([0.0, 0.0], 1.0),
        "track is 0 m long, at least 0.01 m (TRACK_M_MIN); a standing cylinder is an obstacle"
    );
    assert!(refuse([f64::INFINITY, 0.0], 1.0).starts_with("coordinate inf m"));
}
