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

/// What is explained of some flights' closing and sideways speeds when `said` is shown for `seen`.
fn beyond(pairs: &[(Sighted, Sighted)]) -> [Option<f64>; 2] {
    let mut beyond = Beyond::default();
    for (seen, said) in pairs {
        let [mut wanted, mut made] = [vec![0.0; FRAME_PIXELS], vec![0.0; FRAME_PIXELS]];
        draw([*seen].into_iter(), &mut wanted);
        draw([*said].into_iter(), &mut made);
        beyond.add(&made, &wanted);
    }
    beyond.explained().map(|(_, share)| share)
}

#[test]
fn mean_speeds_in_the_right_places_say_nothing_of_velocities() {
    let with = |velocity_m_per_s| Sighted { velocity_m_per_s, ..AHEAD };
    let seen = [[-0.8, 0.0], [0.8, 0.0], [0.0, 0.8], [0.0, -0.8]].map(with);
    // Closing at 0.8 m/s in a quarter of the flights, to either side as often.
    let mean = with([-0.2, 0.0]);
    let near = |share: Option<f64>, wanted: f64| {
        assert!((share.unwrap() - wanted).abs() < 1e-6, "{share:?}, {wanted}");
    };
    let [closing, sideways] = beyond(&seen.map(|seen| (seen, mean)));
    near(closing, 0.0);
    near(sideways, 0.0);
    let [closing, sideways] = beyond(&seen.map(|seen| (seen, seen)));
    near(closing, 1.0);
    near(sideways, 1.0);
    // Directions that are wrong are worse than none.
    let mirrored = |s: Sighted| Sighted {
        velocity_m_per_s: [s.velocity_m_per_s[0], -s.velocity_m_per_s[1]],
        ..s
    };
    let [closing, sideways] = beyond(&seen.map(|seen| (seen, mirrored(seen))));
    near(closing, 1.0);
    near(sideways, -3.0);
}

#[test]
fn there_is_nothing_to_explain_where_no_speed_differs() {
    let closing = Sighted { velocity_m_per_s: [-0.5, 0.0], ..AHEAD };
    assert_eq!(beyond(&[(closing, closing)]), [None, None]);
    assert_eq!(beyond(&[]), [None, None]);
}
