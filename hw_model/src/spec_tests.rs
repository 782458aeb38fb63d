use super::*;

fn changed(from: &str, to: &str) -> Result<ChipSpec, ChipError> {
    assert!(LOIHI1.contains(from), "{from} is gone from the chip file");
    ChipSpec::parse("mine.toml", &LOIHI1.replacen(from, to, 1))
}

#[test]
fn loihi1_has_the_published_limits() {
    let limits = ChipSpec::loihi1().limits;
    assert_eq!((limits.cores, limits.compartments_per_core), (128, 1024));
    assert_eq!((limits.input_axons_per_core, limits.synapse_words_per_core), (4096, 16_384));
}

#[test]
fn tiles_follow_the_published_coordinates() {
    let mesh = ChipSpec::loihi1().mesh;
    for id in 0..128u16 {
        assert_eq!(mesh.tile(id), (id / 16, (id % 16) / 4));
    }
}

#[test]
fn an_unknown_key_is_refused_with_its_line() {
    let error = changed("name = \"loihi1\"", "name = \"x\"\nspeed = 3").unwrap_err().to_string();
    assert!(error.starts_with("chip mine.toml: "), "{error}");
    assert!(error.contains("unknown field `speed`"), "{error}");
}

#[test]
fn an_unknown_name_says_what_there_is() {
    assert_eq!(
        ChipSpec::named("loihi9").unwrap_err().to_string(),
        "chip loihi9: no such built-in chip (there is: loihi1)"
    );
}

#[test]
fn numbers_out_of_range_name_field_value_and_limit() {
    assert_eq!(
        changed("current_bits = 23", "current_bits = 40").unwrap_err().to_string(),
        "chip loihi1: arithmetic.current_bits = 40, must be 1..=30; correct the chip file"
    );
    assert_eq!(
        changed("cores = 128", "cores = 129").unwrap_err().to_string(),
        "chip loihi1: limits.cores = 129, must be 1..=128 (mesh: tiles_x * tiles_y * cores_per_tile); correct the chip file"
    );
    assert_eq!(
        changed("chip_mw = 104.0", "chip_mw = nan").unwrap_err().to_string(),
        "chip loihi1: static_power.chip_mw = NaN, must be a number in 0..=1e9; correct the chip file"
    );
}

#[test]
fn cost_tables_of_one_name_are_refused() {
    assert_eq!(
        changed("name = \"sanafe\"", "name = \"davies2018\"").unwrap_err().to_string(),
        "chip loihi1: cost_tables[1].name = davies2018, must be a name that no other cost table \
         has; correct the chip file"
    );
}

#[test]
fn barrier_points_out_of_order_or_missing_are_refused() {
    let published = "[[1.0, 113.0], [32.0, 465.0]]";
    let error = |to: &str| changed(published, to).unwrap_err().to_string();
    let limit = "must be one point or more, by increasing number of tiles; correct the chip file";
    let field = "chip loihi1: cost_tables.davies2018.barrier_ns_by_tiles";
    assert_eq!(error("[]"), format!("{field} = [], {limit}"));
    assert_eq!(
        error("[[2.0, 5.0], [2.0, 6.0]]"),
        format!("{field} = [(2.0, 5.0), (2.0, 6.0)], {limit}")
    );
}

#[test]
fn narrower_registers_narrow_the_threshold_too() {
    let loihi = ChipSpec::loihi1();
    assert_eq!(loihi.with_state_bits(24, 24).unwrap(), loihi);
    let chip = loihi.with_state_bits(20, 16).unwrap();
    let a = &chip.arithmetic;
    assert_eq!((a.current_bits, a.voltage_bits, a.threshold_mantissa_bits), (19, 15, 9));
    assert_eq!(chip.name, "loihi1/u20/v16");
    // The largest threshold can still be exceeded.
    assert!(a.threshold_mantissa_max() << a.threshold_shift < (1 << a.voltage_bits) - 1);
    let error = loihi.with_state_bits(24, 7).unwrap_err().to_string();
    let part = "loihi1/u24/v7: arithmetic.threshold_mantissa_bits = 0, must be 1..=24";
    assert!(error.contains(part), "{error}");
    let error = loihi.with_state_bits(0, 24).unwrap_err().to_string();
    assert!(error.contains("arithmetic.current_bits = 0, must be 1..=30"), "{error}");
}
