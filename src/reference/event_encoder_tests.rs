use super::*;
use crate::net::EncoderKind;
use crate::net::eem_san::{ConvLayer, Readout};
use crate::rng::{Draw, Streams, stream};

fn numbers(draw: &mut Draw, n: usize, scale: f64) -> Vec<f32> {
    (0..n).map(|_| (scale * draw.uniform_in(-1.0, 1.0)) as f32).collect()
}

/// Layers of some output channels each.
fn encoder_of(channels: &[usize]) -> EventEncoder {
    let mut draw = Streams::new(3, 0).at(stream::STIMULUS, 0);
    let mut layers = Vec::new();
    let inputs = [1].iter().chain(channels);
    for (index, (inputs, outputs)) in inputs.zip(channels).enumerate() {
        let (inputs, outputs, side) = (*inputs, *outputs, 128 >> index);
        layers.push(ConvLayer {
            name: format!("encoder.{}", index + 1),
            inputs,
            outputs,
            side,
            weights: numbers(&mut draw, inputs * outputs * 16, 0.9),
            bias: numbers(&mut draw, outputs, 0.1),
        });
    }
    let neurons = layers[layers.len() - 1].neurons();
    EventEncoder {
        kind: EncoderKind::Hsvae,
        layers,
        threshold: 0.5,
        keep_current: 0.5,
        keep_voltage: 0.75,
        readout: Readout {
            weights: numbers(&mut draw, 4 * neurons, 0.1),
            bias: numbers(&mut draw, 4, 1.0),
        },
    }
}

fn encoder() -> EventEncoder {
    encoder_of(&[3, 2])
}

/// The convolution as its definition has it, output by output.
fn drive(layer: &ConvLayer, input: &[f64]) -> Vec<f64> {
    let (side, half) = (layer.side as i64, layer.side as i64 / 2);
    let mut all = Vec::new();
    for output in 0..layer.outputs {
        for y in 0..half {
            for x in 0..half {
                let mut sum = f64::from(layer.bias[output]);
                for tap in 0..layer.inputs * 16 {
                    let (channel, row, column) = (tap / 16, tap as i64 / 4 % 4, tap as i64 % 4);
                    let (py, px) = (2 * y + row - 1, 2 * x + column - 1);
                    if (0..side).contains(&py) && (0..side).contains(&px) {
                        let pixel = channel as i64 * side * side + py * side + px;
                        let weight = layer.weights[output * layer.inputs * 16 + tap];
                        sum += f64::from(weight) * input[pixel as usize];
                    }
                }
                all.push(sum);
            }
        }
    }
    all
}

#[test]
fn event_driven_encoder_equals_its_definition() {
    let encoder = encoder();
    let mut fast = FloatEncoder::new(&encoder);
    let mut draw = Streams::new(4, 0).at(stream::STIMULUS, 0);
    let mut states: Vec<Vec<[f64; 3]>> =
        encoder.layers.iter().map(|layer| vec![[0.0; 3]; layer.neurons()]).collect();
    for _ in 0..4 {
        let mut frame = EventFrame::default();
        (0..900).for_each(|_| frame.set(draw.below(128) as usize, draw.below(128) as usize));
        fast.step(&frame);
        let mut input = vec![0.0; 128 * 128];
        frame.active().for_each(|pixel| input[pixel] = 1.0);
        for (layer, state) in encoder.layers.iter().zip(&mut states) {
            let drive = drive(layer, &input);
            for ([c, v, s], x) in state.iter_mut().zip(drive) {
                *c = 0.5 * *c + x;
                *v = 0.75 * *v * (1.0 - *s) + *c;
                *s = f64::from(*v > 0.5);
            }
            input = state.iter().map(|[_, _, s]| *s).collect();
        }
    }
    let voltages: Vec<f64> = states[1].iter().map(|[_, v, _]| *v).collect();
    assert!(fast.spikes()[1] > 100, "the test needs spikes: {:?}", fast.spikes());
    for (output, found) in fast.state().into_iter().enumerate() {
        let row = &encoder.readout.weights[output * voltages.len()..];
        let sum: f64 = row.iter().zip(&voltages).map(|(w, v)| f64::from(*w) * v).sum();
        let wanted = sum + f64::from(encoder.readout.bias[output]);
        assert!((f64::from(found) - wanted).abs() < 1e-3, "output {output}: {found} {wanted}");
    }
}

#[test]
fn reset_brings_back_the_first_state() {
    let encoder = encoder();
    let mut used = FloatEncoder::new(&encoder);
    let mut frame = EventFrame::default();
    (0..128).for_each(|x| frame.set(x, 60));
    (0..5).for_each(|_| used.step(&frame));
    used.reset();
    used.step(&frame);
    let mut fresh = FloatEncoder::new(&encoder);
    fresh.step(&frame);
    assert_eq!(used.state(), fresh.state());
    assert_eq!(used.frames(), 6);
}

/// Every neuron by itself in 32-bit floats: its bias, then its inputs in their order by row, column
/// and channel.
fn plain_step(
    layer: &ConvLayer,
    encoder: &EventEncoder,
    input: &[bool],
    state: &mut [(f32, f32, bool)],
) -> Vec<bool> {
    let (side, half) = (layer.side, layer.side / 2);
    for (neuron, (c, v, s)) in state.iter_mut().enumerate() {
        let (pixel, output) = (neuron / layer.outputs, neuron % layer.outputs);
        let mut drive = layer.bias[output];
        for tap in 0..16 {
            let (y, x) = (2 * (pixel / half) + tap / 4, 2 * (pixel % half) + tap % 4);
            if !(1..=side).contains(&y) || !(1..=side).contains(&x) {
                continue;
            }
            let first = ((y - 1) * side + x - 1) * layer.inputs;
            for channel in (0..layer.inputs).filter(|channel| input[first + channel]) {
                drive += layer.weights[(output * layer.inputs + channel) * 16 + tap];
            }
        }
        *c = encoder.keep_current as f32 * *c + drive;
        *v = encoder.keep_voltage as f32 * *v * (1.0 - f32::from(*s)) + *c;
        *s = *v > encoder.threshold as f32;
    }
    state.iter().map(|(_, _, s)| *s).collect()
}

#[test]
fn every_bit_is_that_of_plain_loops_for_all_numbers_of_channels() {
    // One vector of 4, 8 or 16 lanes, several of them, and what is no whole number of them.
    for channels in [&[16usize, 32, 16, 1][..], &[8, 4], &[64, 24], &[5, 3]] {
        let encoder = encoder_of(channels);
        let mut fast = FloatEncoder::new(&encoder);
        let mut draw = Streams::new(5, 0).at(stream::STIMULUS, 0);
        let mut states: Vec<Vec<(f32, f32, bool)>> =
            encoder.layers.iter().map(|layer| vec![(0.0, 0.0, false); layer.neurons()]).collect();
        let mut spikes = vec![0; channels.len()];
        for _ in 0..3 {
            let frame = EventFrame::random(&mut draw, 700);
            fast.step(&frame);
            let mut input: Vec<bool> =
                (0..128 * 128).map(|n| frame.get(n % 128, n / 128)).collect();
            for ((layer, state), spikes) in encoder.layers.iter().zip(&mut states).zip(&mut spikes)
            {
                input = plain_step(layer, &encoder, &input, state);
                *spikes += input.iter().filter(|spike| **spike).count() as u64;
            }
        }
        assert_eq!(fast.spikes(), spikes);
        let Layers::Spiking(layers) = &fast.layers else { panic!("spiking layers expected") };
        for ((layer, state), outputs) in layers.iter().zip(&states).zip(channels) {
            let area = state.len() / outputs;
            for (neuron, voltage) in layer.voltages().iter().enumerate() {
                let expected = state[neuron % area * outputs + neuron / area].1;
                assert_eq!(voltage.to_bits(), expected.to_bits(), "{channels:?}: {neuron}");
            }
        }
    }
}

/// The encoder as AVAE's.
fn artificial_of(channels: &[usize]) -> EventEncoder {
    EventEncoder {
        kind: EncoderKind::Avae,
        threshold: 0.0,
        keep_current: 0.0,
        keep_voltage: 0.0,
        ..encoder_of(channels)
    }
}

/// Artificial neurons one by one in 32-bit floats: bias, then each input above 0 times its weight,
/// in the order by row, column and channel. `input` and result are in that order.
fn plain_sums(layer: &ConvLayer, input: &[f32]) -> Vec<f32> {
    let (side, half) = (layer.side, layer.side / 2);
    let mut sums = Vec::new();
    for neuron in 0..layer.neurons() {
        let (pixel, output) = (neuron / layer.outputs, neuron % layer.outputs);
        let mut sum = layer.bias[output];
        for tap in 0..16 {
            let (y, x) = (2 * (pixel / half) + tap / 4, 2 * (pixel % half) + tap % 4);
            if !(1..=side).contains(&y) || !(1..=side).contains(&x) {
                continue;
            }
            let first = ((y - 1) * side + x - 1) * layer.inputs;
            for channel in (0..layer.inputs).filter(|channel| input[first + channel] > 0.0) {
                let weight = layer.weights[(output * layer.inputs + channel) * 16 + tap];
                sum += input[first + channel] * weight;
            }
        }
        sums.push(sum);
    }
    sums
}

#[test]
fn artificial_layers_have_every_bit_of_plain_loops_and_no_memory() {
    for channels in [&[16usize, 32, 16, 1][..], &[8, 4], &[64, 24], &[5, 3], &[2]] {
        let encoder = artificial_of(channels);
        let mut fast = FloatEncoder::new(&encoder);
        let mut draw = Streams::new(5, 0).at(stream::STIMULUS, 0);
        let last = encoder.layers.last().unwrap();
        for tick in 0..2 {
            let mut sums = vec![0.0f32; last.neurons()];
            for _ in 0..if tick == 0 { FRAMES_PER_TICK } else { 2 } {
                let frame = EventFrame::random(&mut draw, 700);
                fast.step(&frame);
                let pixel = |n: usize| f32::from(u8::from(frame.get(n % 128, n / 128)));
                let mut values: Vec<f32> = (0..128 * 128).map(pixel).collect();
                for (layer, spiking) in encoder.layers.iter().zip(fast.spiking()) {
                    values = plain_sums(layer, &values);
                    let above = values.iter().filter(|value| **value > 0.0).count();
                    // The few sums of the last layer may all have one sign.
                    let partial = above > 0 && above < values.len();
                    assert!(partial || layer.name == last.name, "{}: {above}", layer.name);
                    assert_eq!(spiking.len(), above);
                }
                sums.iter_mut().zip(&values).for_each(|(sum, value)| *sum += value);
            }
            let frames = if tick == 0 { 5.0 } else { 2.0 };
            let area = sums.len() / last.outputs;
            let mean: Vec<f32> = (0..sums.len())
                .map(|n| sums[n % area * last.outputs + n / area] / frames)
                .collect();
            let expected = encoder.readout.apply(&mean);
            let bits = |all: &[f32]| all.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&fast.state()), bits(&expected), "{channels:?}, tick {tick}");
        }
    }
}

#[test]
fn an_encoder_that_forgets_begins_every_tick_at_rest() {
    let mut encoder = encoder();
    let mut carries = FloatEncoder::new(&encoder);
    encoder.kind = EncoderKind::Fsvae;
    let mut forgets = FloatEncoder::new(&encoder);
    let mut draw = Streams::new(6, 0).at(stream::STIMULUS, 0);
    let frames: Vec<EventFrame> = (0..10).map(|_| EventFrame::random(&mut draw, 700)).collect();
    for (index, frame) in frames.iter().enumerate() {
        forgets.step(frame);
        if index == 5 {
            // What it saw is there until the next tick's first frame.
            carries.reset();
        }
        carries.step(frame);
        assert_eq!(forgets.state(), carries.state(), "frame {index}");
        assert_eq!(forgets.spiking(), carries.spiking(), "frame {index}");
    }
    // A trial that ends within a tick is followed by one that begins a tick.
    forgets.step(&frames[0]);
    forgets.reset();
    carries.reset();
    for (index, frame) in frames.iter().take(5).enumerate() {
        forgets.step(frame);
        carries.step(frame);
        assert_eq!(forgets.state(), carries.state(), "frame {index} of the next trial");
    }
}
