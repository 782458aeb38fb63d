use super::*;

const AHEAD: Sighted =
    Sighted { way_m: [3.0, 0.0], distance_m: 3.0, velocity_m_per_s: [0.0; 2], radius_m: 0.3 };

/// Brightness of each band at a column.
fn bands(movers: &[Sighted], column: usize) -> [f32; 4] {
    let mut picture = vec![0.5; FRAME_PIXELS];
    draw(movers.iter().copied(), &mut picture);
    BANDS.map(|(_, rows)| {
        let all = rows.map(|row| picture[row * FRAME_COLUMNS + column]).collect::<Vec<_>>();
        assert!(all.iter().all(|pixel| *pixel == all[0]), "{all:?}");
        all[0]
    })
}

#[test]
fn bands_are_all_rows() {
    let ends: Vec<usize> = BANDS.iter().map(|(_, rows)| rows.end).collect();
    let starts: Vec<usize> = BANDS.iter().map(|(_, rows)| rows.start).collect();
    assert_eq!(starts[1..], ends[..3]);
    assert_eq!((starts[0], ends[3] * FRAME_COLUMNS), (0, FRAME_PIXELS));
}

#[test]
fn velocities_have_bands_of_their_own() {
    let with = |velocity_m_per_s| [Sighted { velocity_m_per_s, ..AHEAD }];
    assert_eq!(bands(&[], 64), [0.0; 4]);
    assert_eq!(bands(&[AHEAD], 64), [0.5, 0.0, 0.0, 0.0]);
    assert_eq!(bands(&with([-0.5, 0.0]), 64), [0.5, 0.25, 0.0, 0.0]);
    assert_eq!(bands(&with([0.5, 0.0]), 64), [0.5, 0.0, 0.0, 0.0]);
    assert_eq!(bands(&with([0.0, 0.5]), 64), [0.5, 0.0, 0.25, 0.0]);
    assert_eq!(bands(&with([0.0, -3.0]), 64), [0.5, 0.0, 0.0, 0.5]);
    // Seen on the left it comes nearer by going to the right.
    let beside =
        Sighted { way_m: [1.5, 1.5], distance_m: 3.0, velocity_m_per_s: [0.0, -0.5], ..AHEAD };
    let [near, closing, left, right] = bands(&[beside], 0);
    assert!(near == 0.5 && closing > 0.1 && left == 0.0 && right > 0.1);
}

#[test]
fn a_mover_stands_in_its_columns_and_the_brighter_one_shows() {
    // 0.3 m of 3 m are 6.4 of 64 columns, and 4 more.
    let lit = |column| bands(&[AHEAD], column)[0] > 0.0;
    let columns: Vec<usize> = (0..FRAME_COLUMNS).filter(|column| lit(*column)).collect();
    assert_eq!((columns[0], columns.len()), (53, 21));
    let left = Sighted { way_m: [2.0, 1.0], distance_m: 5f64.sqrt(), ..AHEAD };
    assert!(bands(&[left], 32)[0] > 0.0 && bands(&[left], 96)[0] == 0.0);
    let nearer = Sighted { way_m: [1.5, 0.0], distance_m: 1.5, ..AHEAD };
    assert_eq!(bands(&[nearer, AHEAD], 64)[0], 0.75);
    assert_eq!(bands(&[AHEAD, nearer], 64)[0], 0.75);
    // Most of it outside of the picture.
    let edge = Sighted { way_m: [1.0, -0.99], distance_m: 1.41, ..AHEAD };
    assert!(bands(&[edge], 127)[0] > 0.0);
}
