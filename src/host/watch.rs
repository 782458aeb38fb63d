//! Spikes of all layers, sorted into the steps in which the layers work.

use hw_model::engine::PopulationSpikes;

/// Neurons that spiked in each of `len` steps from `open` on, rising.
pub(super) fn spikes_by_step(spikes: &PopulationSpikes, open: u64, len: u32) -> Vec<Vec<u32>> {
    let mut steps = vec![Vec::new(); len as usize];
    for (step, neuron) in spikes {
        let at = step.checked_sub(open).and_then(|at| steps.get_mut(at as usize));
        at.into_iter().for_each(|step| step.push(*neuron));
    }
    steps
}
