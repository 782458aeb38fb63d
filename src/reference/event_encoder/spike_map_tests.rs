use super::*;

#[test]
fn marked_neurons_are_read_back_within_their_margin() {
    for channels in [1, 3, 16, 32] {
        let mut map = SpikeMap::new(channels, 8);
        let neurons = [0, channels - 1, 7 * channels, 8 * channels, 64 * channels - 1];
        neurons.iter().for_each(|neuron| map.mark(*neuron));
        let mut distinct = neurons.to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(map.n_spikes(), distinct.len() as u64);
        for neuron in 0..64 * channels {
            let (row, rest) = (neuron / (8 * channels), neuron % (8 * channels));
            let bit = map.padded_row(row + 1).bits(channels + rest) & 1;
            assert_eq!(bit == 1, distinct.contains(&neuron), "neuron {neuron} of {channels}");
        }
        map.clear();
        assert_eq!(map.n_spikes(), 0);
    }
}

#[test]
fn several_neurons_are_marked_at_once_across_words() {
    let mut map = SpikeMap::new(24, 4);
    map.merge(2, 48, 0x00ff_f0f0);
    let expected: Vec<usize> = (0..24).filter(|bit| 0x00ff_f0f0 >> bit & 1 == 1).collect();
    let pixel = 2 * 4 + 2;
    let found: Vec<usize> = map.channel_by_channel().into_iter().map(|n| n as usize).collect();
    assert_eq!(found, expected.iter().map(|channel| channel * 16 + pixel).collect::<Vec<_>>());
}
