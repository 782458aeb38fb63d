use super::*;

/// Sizes of the paper.
fn eem_san() -> Shape {
    let conv = |(inputs, outputs, side)| ConvShape { inputs, outputs, side };
    let dense = |(inputs, outputs)| DenseShape { inputs, outputs };
    Shape {
        encoder: [(1, 16, 128), (16, 32, 64), (32, 16, 32), (16, 1, 16)].map(conv).to_vec(),
        readout: dense((64, 64)),
        branches: [(220, 20), (640, 20)].map(dense),
        decision: [(20, 256), (256, 256), (256, 256), (256, 2)].map(dense).to_vec(),
        frames: 5,
        steps: 5,
    }
}

/// No spike anywhere.
fn silent(shape: &Shape) -> Modules<Activity> {
    let (encoder, decision) = (shape.encoder.len(), shape.dense_layers().count());
    Modules {
        spiking_encoder: Activity::new(encoder + 1, encoder),
        artificial_encoder: Activity::new(encoder + 1, 0),
        spiking_decision: Activity::new(decision, decision),
        artificial_decision: Activity::new(decision, 0),
    }
}

fn paper(row: Row) -> Ops {
    let shape = eem_san();
    row.counts(&closed_form(&shape, &silent(&shape), 1)).paper
}

#[test]
fn paper_table5_row_i_multiplications() {
    assert_eq!(paper(Row::SpikingSpiking).multiplications, 5_242_880);
}

#[test]
fn paper_table5_row_ii_multiplications() {
    assert_eq!(paper(Row::ArtificialSpiking).multiplications, 57_794_560);
}

#[test]
fn paper_table5_row_iii_multiplications() {
    assert_eq!(paper(Row::SpikingArtificial).multiplications, 8_517_920);
}

#[test]
fn paper_table5_row_iv_multiplications_and_additions() {
    let ops = paper(Row::ArtificialArtificial);
    assert_eq!(ops, Ops { additions: 61_586_610, multiplications: 61_069_600 });
}

#[test]
fn rows_round_to_what_the_paper_prints() {
    for (row, printed) in Row::ALL.into_iter().zip(PRINTED) {
        let ours = paper(row).multiplications as f64;
        assert!((ours - printed.multiplications).abs() < 0.5001e5, "{row:?}: {ours}");
    }
    let additions = paper(Row::ArtificialArtificial).additions as f64;
    assert!((additions - PRINTED[3].additions).abs() < 0.5e5, "{additions}");
}

#[test]
fn true_products_of_the_artificial_decision_are_a_quarter_of_the_papers() {
    let shape = eem_san();
    let counts = closed_form(&shape, &silent(&shape), 1).artificial_decision;
    assert_eq!(counts.exact.multiplications, 769_520);
    assert_eq!(counts.paper.multiplications, 3_275_040);
    assert_eq!(counts.exact.additions, 769_520 + 5 * 20);
    assert_eq!(counts.neurobench.dense, 769_520);
}

#[test]
fn spikes_at_the_implied_rates_give_the_papers_additions() {
    let shape = eem_san();
    assert!((implied_encoder_rate(&shape) - 0.1376).abs() < 5e-5);
    assert!((implied_decision_rate(&shape) - 0.4414).abs() < 5e-5);
    let mut activity = silent(&shape);
    let rate = implied_encoder_rate(&shape);
    for (layer, from) in activity.spiking_encoder.layers[1..].iter_mut().zip(&shape.encoder) {
        layer.arrivals = (rate * (5 * from.neurons()) as f64).round() as u64;
    }
    let fan_in = [220, 640, 40, 256, 256, 256];
    for (layer, inputs) in activity.spiking_decision.layers.iter_mut().zip(fan_in) {
        layer.arrivals = (implied_decision_rate(&shape) * f64::from(5 * inputs)).round() as u64;
    }
    let counts = closed_form(&shape, &activity, 1);
    for (row, printed) in Row::ALL.into_iter().zip(PRINTED) {
        let ours = row.counts(&counts).paper.additions as f64;
        assert!((ours - printed.additions).abs() < 0.5e5, "{row:?}: {ours}");
    }
}

#[test]
fn neurons_of_the_paper() {
    let shape = eem_san();
    assert_eq!((shape.encoder_neurons(), shape.decision_neurons()), (102_464, 810));
}

#[test]
fn operations_of_the_artificial_counterpart_need_no_run() {
    let shape = eem_san();
    let row = Row::ArtificialArtificial.counts(&closed_form(&shape, &silent(&shape), 3)).exact;
    let per_tick = artificial_ops(&shape);
    assert_eq!(3 * per_tick.multiplications, row.multiplications);
    assert_eq!(3 * per_tick.additions, row.additions);
}
