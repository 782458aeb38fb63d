use super::*;

fn outcome(outcome: Outcome, mover_contact: Option<MoverContact>) -> TrialOutcome {
    TrialOutcome {
        outcome,
        hit: None,
        mover_contact,
        path_m: 0.0,
        time_s: 0.0,
        ticks: 0,
        decisions: 0,
        mean_speed_m_per_s: 0.0,
        end_goal_distance_m: 0.0,
        trajectory: vec![],
    }
}

fn hit(bearing_mrad: i32, camera_ticks: u32, laser_ticks: u32) -> TrialOutcome {
    let contact = MoverContact { bearing_mrad, ticks: 20, camera_ticks, laser_ticks };
    outcome(Outcome::Collision, Some(contact))
}

fn some() -> Contacts {
    let outcomes = [
        outcome(Outcome::Success, None),
        outcome(Outcome::TimeOut, None),
        outcome(Outcome::Collision, None),
        hit(-100, 20, 20),
        hit(1000, 1, 20),
        hit(1200, 0, 1),
        hit(3000, 0, 0),
        hit(-2000, 0, 0),
    ];
    Contacts::new(outcomes.iter())
}

#[test]
fn contacts_are_counted_by_side_and_by_view() {
    let expected =
        Contacts { standing: 1, ahead: 1, beside: 2, behind: 2, camera: 2, laser: 1, neither: 2 };
    assert_eq!(some(), expected);
    let mut twice = some();
    twice += some();
    let six =
        Contacts { standing: 2, ahead: 2, beside: 4, behind: 4, camera: 4, laser: 2, neither: 4 };
    assert_eq!(twice, six);
}

#[test]
fn contacts_add_up() {
    assert!(some().add_up_to(6));
    assert!(!some().add_up_to(5));
    assert!(!Contacts { neither: 1, ..some() }.add_up_to(6));
    assert!(!Contacts { standing: u64::MAX, ..some() }.add_up_to(4));
    assert!(!Contacts { ahead: u64::MAX, camera: u64::MAX, ..some() }.add_up_to(4));
    assert!(Contacts::default().add_up_to(0));
}

#[test]
fn a_table_has_a_row_for_each_and_dashes_where_nothing_was_counted() {
    let rows = [(vec!["a".to_owned()], Some(some())), (vec!["b".to_owned()], None)];
    let table = contact_table(&["network"], &rows).unwrap().to_string();
    let columns = |line: &str| {
        line.split('|')
            .map(str::trim)
            .filter(|s| !s.is_empty())
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let lines: Vec<Vec<String>> = table.lines().map(columns).collect();
    let of = |name: &str| lines.iter().find(|line| line[0] == name).unwrap()[1..].join(" ");
    assert_eq!(of("network"), "standing mover ahead beside behind by camera laser neither");
    assert_eq!(of("a"), "1 1 2 2 2 1 2");
    assert_eq!(of("b"), "- - - - - - -");
}

#[test]
fn there_is_no_table_without_movers() {
    let standing = Contacts { standing: 3, ..Contacts::default() };
    assert!(contact_table(&[], &[(vec![], Some(standing)), (vec![], None)]).is_none());
}

#[test]
fn counts_of_any_size_are_shown() {
    let mut most = Contacts { standing: 0, ahead: u64::MAX, beside: u64::MAX, ..some() };
    most += most;
    assert_eq!((most.standing, most.ahead, most.behind), (0, u64::MAX, 4));
    assert!(contact_table(&[], &[(vec![], Some(most))]).is_some());
}
