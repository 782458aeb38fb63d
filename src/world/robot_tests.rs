use super::*;

fn driven(actuators: &str, command: Twist, steps: usize) -> Robot {
    let mut robot = Robot::new(Pose::new(0.0, 0.0, 0.0), actuators.parse().unwrap());
    (0..steps).for_each(|_| robot.step(command));
    robot
}

const AHEAD: Twist = Twist { linear_m_per_s: 0.5, angular_rad_per_s: 0.0 };

#[test]
fn wheel_fractions_become_speeds() {
    let twist = Twist::of_wheels(0.0, 1.0, 0.5);
    assert_eq!(twist.linear_m_per_s, 0.275);
    assert!((twist.angular_rad_per_s - 1.8).abs() < 1e-12);
    assert_eq!(Twist::of_wheels(0.0, 0.0, 1.0).linear_m_per_s, 0.05);
    assert_eq!(Twist::of_wheels(1.0, 1.0, 1.0).linear_m_per_s, 1.0);
    assert!(Twist::of_wheels(1.0, 0.0, 0.5).angular_rad_per_s < 0.0);
}

#[test]
fn ideal_actuators_follow_at_once() {
    let robot = driven("ideal", AHEAD, 1);
    assert_eq!(robot.twist(), AHEAD);
    assert_eq!(robot.pose(), Pose::new(0.005, 0.0, 0.0));
    assert_eq!(robot.path_m(), 0.005);
}

#[test]
fn a_delay_holds_the_robot_still_for_exactly_that_time() {
    assert_eq!(driven("v:0.1+0,w:0+0", AHEAD, 10).path_m(), 0.0);
    assert_eq!(driven("v:0.1+0,w:0+0", AHEAD, 11).path_m(), 0.005);
}

#[test]
fn a_lag_follows_the_closed_form() {
    for steps in [1, 30, 100] {
        let robot = driven("v:0+0.3,w:0+0.3", AHEAD, steps);
        let (t_s, tau_s) = (0.01 * steps as f64, 0.3);
        let speed = 0.5 * (1.0 - libm::exp(-t_s / tau_s));
        let way_m = 0.5 * (t_s - tau_s * (1.0 - libm::exp(-t_s / tau_s)));
        assert!((robot.twist().linear_m_per_s - speed).abs() < 1e-13);
        assert!((robot.path_m() - way_m).abs() < 1e-13);
    }
}

#[test]
fn the_channels_have_lags_of_their_own() {
    let turning = Twist { linear_m_per_s: 0.5, angular_rad_per_s: 1.0 };
    let robot = driven("v:0.2+0.15,w:0.1+0", turning, 15);
    assert_eq!(robot.path_m(), 0.0);
    assert_eq!(robot.twist().angular_rad_per_s, 1.0);
    assert!((robot.pose().yaw_rad - 0.05).abs() < 1e-12);
}

#[test]
fn a_full_circle_comes_back() {
    let period_steps = 800;
    let angular_rad_per_s = core::f64::consts::TAU / 8.0;
    let robot = driven("ideal", Twist { linear_m_per_s: 0.4, angular_rad_per_s }, period_steps);
    assert!((robot.path_m() - 3.2).abs() < 1e-12);
    assert!(robot.pose().position.coords.norm() < 1e-12, "{:?}", robot.pose());
}
