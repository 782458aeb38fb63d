//! Slowly following target networks.

/// `target = (1 - tau) target + tau online`.
pub fn soft_update(target: &mut [f32], online: &[f32], tau: f32) {
    assert_eq!(target.len(), online.len(), "elements of target and online network");
    target.iter_mut().zip(online).for_each(|(to, from)| *to += tau * (from - *to));
}
