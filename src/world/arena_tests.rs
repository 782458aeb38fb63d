use super::*;
use crate::world::test_data::{BOUNDS, cylinder, mover, rectangle};

fn made(obstacles: Vec<Obstacle>, movers: Vec<Mover>) -> Result<Arena, ArenaError> {
    Arena::new("yard".to_owned(), BOUNDS, obstacles, movers)
}

fn refuse(obstacles: Vec<Obstacle>, movers: Vec<Mover>) -> String {
    made(obstacles, movers).unwrap_err().to_string()
}

#[test]
fn bounds_without_area_are_refused() {
    let bounds = |max: [f64; 2]| Bounds { min: Point2::origin(), max: Point2::from(max) };
    let refuse = |max| {
        let made = Arena::new("yard".to_owned(), bounds(max), vec![], vec![]);
        made.unwrap_err().to_string()
    };
    assert_eq!(
        refuse([5.0, 0.5]),
        "yard: bounds y 0..0.5 m, must rise by 1 m or more within +-1000 m (COORDINATE_M_MAX)"
    );
    assert!(refuse([f64::NAN, 5.0]).starts_with("yard: bounds x 0..NaN m"));
    assert!(refuse([-5.0, 5.0]).starts_with("yard: bounds x 0..-5 m"));
    assert!(refuse([1001.0, 5.0]).starts_with("yard: bounds x 0..1001 m"));
}

#[test]
fn more_things_than_the_limits_are_refused() {
    let posts = |n: usize| (0..n).map(|i| cylinder(&format!("p{i}"), [0.0, 0.0], 0.1)).collect();
    assert!(made(posts(1000), vec![]).is_ok());
    assert_eq!(
        refuse(posts(1001), vec![]),
        "yard: 1001 obstacles, limit 1000 (OBSTACLES_MAX); join or drop some"
    );
    let carts: Vec<Mover> =
        (0..101).map(|i| mover(&format!("m{i}"), [0.0, 0.0], [1.0, 0.0], 1.0)).collect();
    assert_eq!(refuse(vec![], carts), "yard: 101 movers, limit 100 (MOVERS_MAX); drop some");
}

#[test]
fn equal_names_are_refused() {
    let (post, cart) =
        (cylinder("thing", [5.0, 5.0], 0.1), mover("thing", [0.0, 0.0], [1.0, 0.0], 1.0));
    assert_eq!(refuse(vec![post], vec![cart]), "yard: two things are called \"thing\"; rename one");
}

#[test]
fn heights_that_the_laser_misses_are_refused() {
    let low = Obstacle { height_m: 0.3, ..cylinder("kerb", [0.0, 0.0], 0.1) };
    assert_eq!(
        refuse(vec![low], vec![]),
        "yard: kerb: height 0.3 m, must be 0.44..=100 m (the laser scans at 0.44 m)"
    );
    let mut cart = mover("cart", [0.0, 0.0], [1.0, 0.0], 1.0);
    cart.height_m = f64::NAN;
    assert!(refuse(vec![], vec![cart]).starts_with("yard: cart: height NaN m"));
}

#[test]
fn tracks_must_be_clear_and_inside() {
    let cart = || vec![mover("cart", [0.0, 0.0], [5.0, 0.0], 1.0)];
    assert_eq!(
        refuse(vec![cylinder("post", [3.0, 0.5], 0.3)], cart()),
        "yard: cart: track comes within 0.2 m of post, the mover's radius is 0.25 m (overlap at \
         most 0.01 m, TRACK_OVERLAP_M_MAX); shorten or move the track"
    );
    assert!(made(vec![cylinder("post", [3.0, 0.545], 0.3)], cart()).is_ok());
    assert!(made(vec![rectangle("wall", [5.25, -3.0], [6.0, 3.0])], cart()).is_ok());
    assert!(
        refuse(vec![rectangle("wall", [2.0, -3.0], [2.5, 3.0])], cart()).contains("0 m of wall")
    );
    assert_eq!(
        refuse(vec![], vec![mover("cart", [0.0, 0.0], [0.0, -10.5], 1.0)]),
        "yard: cart: track end (0, -10.5) is outside of the arena; shorten the track"
    );
}
