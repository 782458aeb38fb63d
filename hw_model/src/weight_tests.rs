use super::*;

fn format(sign_mode: SignMode, weight_bits: u8, exponent: i8) -> SynapseFormat {
    SynapseFormat { sign_mode, weight_bits, exponent }
}

#[test]
fn mixed_mode_loses_one_bit_to_the_sign() {
    let mixed = format(SignMode::Mixed, 8, 0);
    assert_eq!(mixed.mantissa_step(), 2);
    assert_eq!(mixed.mantissa_range(), (-256, 254));
    assert!(mixed.holds(-256) && mixed.holds(254) && !mixed.holds(255) && !mixed.holds(3));
}

#[test]
fn all_are_held_when_each_one_is() {
    for mode in [SignMode::Mixed, SignMode::Excitatory, SignMode::Inhibitory] {
        for weight_bits in [1, 2, 6, 8] {
            let format = format(mode, weight_bits, 0);
            for mantissa in i16::MIN..=i16::MAX {
                let holds = format.holds(mantissa.into());
                assert_eq!(format.holds_all(&[0, mantissa, 0]), holds, "{format:?} {mantissa}");
            }
        }
    }
}

#[test]
fn split_modes_have_a_step_of_one_at_eight_bits() {
    assert_eq!(format(SignMode::Excitatory, 8, 0).mantissa_range(), (0, 255));
    assert_eq!(format(SignMode::Inhibitory, 8, 0).mantissa_range(), (-255, 0));
    assert_eq!(format(SignMode::Excitatory, 6, 0).mantissa_range(), (0, 252));
}

#[test]
fn all_rules_agree_on_the_grid() {
    for exponent in 0..=7 {
        let mixed = format(SignMode::Mixed, 8, exponent);
        for weight in (-254..=254).step_by(2) {
            let expected = Some(64 * (weight << exponent));
            for rule in [OffGrid::Reject, OffGrid::Nengo, OffGrid::Brian2Loihi, OffGrid::Lava] {
                assert_eq!(effective_weight(weight, &mixed, rule), expected, "{weight} {rule:?}");
            }
        }
    }
}

#[test]
fn the_strict_rule_refuses_off_grid_weights() {
    let mixed = format(SignMode::Mixed, 8, 0);
    assert_eq!(effective_weight(3, &mixed, OffGrid::Reject), None);
    assert_eq!(effective_weight(-3, &mixed, OffGrid::Lava), Some(-256));
    assert_eq!(effective_weight(-3, &mixed, OffGrid::Brian2Loihi), Some(-128));
    assert_eq!(effective_weight(-5, &mixed, OffGrid::Nengo), Some(-256));
}

#[test]
fn effective_steps_fit_sixteen_bits_at_the_extremes() {
    assert_eq!(format(SignMode::Mixed, 8, 7).effective_steps(-256), -i16::MAX);
    assert_eq!(format(SignMode::Excitatory, 8, 7).effective_steps(255), 32_640);
    assert_eq!(format(SignMode::Inhibitory, 8, -8).effective_steps(-1), -1);
}
