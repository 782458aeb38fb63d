use super::*;

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 5e-4
}

#[test]
fn wilson_intervals_of_known_cases() {
    // p = 1/2: centre 1/2, half width z / (2 sqrt(n + z^2)); p = 0: upper end z^2 / (n + z^2).
    let (low, high) = wilson_95(50, 100);
    assert!(near(low, 0.4038) && near(high, 0.5962), "{low} {high}");
    let (low, high) = wilson_95(0, 10);
    assert!(low == 0.0 && near(high, 0.2775), "{low} {high}");
    let (low, high) = wilson_95(10, 10);
    assert!(near(low, 0.7225) && near(high, 1.0), "{low} {high}");
    assert_eq!(wilson_95(0, 0), (0.0, 1.0));
}

#[test]
fn sign_tests_of_known_cases() {
    assert_eq!(sign_test(0, 0), 1.0);
    assert_eq!(sign_test(3, 3), 1.0);
    assert!(near(sign_test(0, 5), 2.0 / 32.0));
    assert!(near(sign_test(8, 2), 2.0 * (1.0 + 10.0 + 45.0) / 1024.0));
    assert_eq!(sign_test(8, 2), sign_test(2, 8));
    assert!(sign_test(0, 2000) < 1e-100);
    // Far beyond where 2^-n is 0 in double precision; by the normal distribution with the correction for
    // whole numbers.
    assert_eq!(sign_test(600, 600), 1.0);
    let normal = |z: f64| libm::erfc(z / 2f64.sqrt());
    for (gained, lost) in [(1040, 960), (1100, 1000), (5200, 5000), (1001, 1000), (30, 20)] {
        let z = ((gained - lost) as f64 - 1.0) / ((gained + lost) as f64).sqrt();
        let (exact, about) = (sign_test(gained, lost), normal(z));
        assert!((exact - about).abs() < 2e-3, "{gained} {lost}: {exact} {about}");
    }
}
