use super::*;

#[test]
fn the_first_is_found_from_anywhere() {
    for first in 3..=9 {
        for near in 0..14 {
            assert_eq!(first_from(near, 3..9, |at| at >= first), first);
        }
    }
    assert_eq!(first_from(0, 4..4, |_| true), 4);
}
