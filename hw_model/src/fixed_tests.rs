use super::*;

/// The rule as the sources write it, in 64 bit.
fn decay_by_definition(x: i64, decay: i64) -> i64 {
    x.signum() * ((x.abs() * (4096 - decay)) >> 12)
}

#[test]
fn decay_equals_its_definition_for_every_value() {
    for decay in [0u32, 1, 1024, 1365, 2048, 4095, 4096] {
        for x in -(1i32 << 24)..=(1 << 24) {
            let fast = decay_toward_zero(x, DECAY_UNIT - decay);
            assert!(
                i64::from(fast) == decay_by_definition(i64::from(x), i64::from(decay)),
                "x = {x}, decay = {decay}: {fast}"
            );
        }
    }
}

#[test]
fn decay_of_negative_values_truncates_toward_zero() {
    // 2310 * 2731 = 6 308 610; >> 12 = 1540; a floor instead would give -1541.
    assert_eq!(decay_toward_zero(-2310, 4096 - 1365), -1540);
    assert_eq!(decay_toward_zero(-7, 2048), -3);
}

#[test]
fn any_decay_of_at_least_one_reaches_zero() {
    let mut x = (1 << 23) - 1;
    let mut steps = 0;
    while x != 0 {
        x = decay_toward_zero(x, DECAY_UNIT - 1);
        steps += 1;
        assert!(steps < 100_000, "still {x}");
    }
}

#[test]
fn wrap_is_twos_complement_at_both_ends() {
    let limit = 1i64 << 23;
    assert_eq!(wrap_signed(limit - 1, 23), 8_388_607);
    assert_eq!(wrap_signed(limit, 23), -8_388_608);
    assert_eq!(wrap_signed(-limit, 23), -8_388_608);
    assert_eq!(wrap_signed(-limit - 1, 23), 8_388_607);
}

#[test]
fn clip_is_symmetric() {
    assert_eq!(clip_signed(1 << 23, 23), 8_388_607);
    assert_eq!(clip_signed(-(1 << 23), 23), -8_388_607);
}

#[test]
fn narrow_tells_whether_the_value_fitted() {
    assert_eq!(narrow(5, 21, Overflow::Wrap), (5, false));
    assert_eq!(narrow(1 << 21, 21, Overflow::Wrap), (-(1 << 21), true));
    assert_eq!(narrow(1 << 21, 21, Overflow::Clip), ((1 << 21) - 1, true));
}
