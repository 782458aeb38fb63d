use super::*;
use crate::CoreMap;
use crate::container::{self, Kind};
use crate::synapse::{SynapseEntry, SynapseForm};
use crate::weight::SignMode;

const KIND: Kind = Kind { label: *b"SLPACKED", version: 1, advice: "make it again" };

#[derive(Debug, Serialize, Deserialize)]
struct File(#[serde(with = "super")] CoreMapParts);

fn list(mantissas: &[i16]) -> SynapseList {
    let dense = SynapseForm::Dense { first: 1, mantissas: mantissas.to_vec() };
    let targets = (0..mantissas.len() as u16).map(|target| 2 * target).collect();
    let sparse = SynapseForm::Sparse { targets, mantissas: mantissas.to_vec() };
    SynapseList { entries: [dense, sparse].map(|form| SynapseEntry { format: 0, form }).into() }
}

/// Two cores with a list in common, each sending to the other.
fn parts() -> CoreMapParts {
    let core = |own: i16| Core {
        label: format!("own{own}"),
        groups: vec![CompartmentGroup {
            len: 8,
            decay_current: 4096,
            decay_voltage: 0,
            threshold_mantissa: 1,
            bias_mantissa: 0,
            bias_exponent: 0,
            refractory_steps: 1,
        }],
        formats: vec![SynapseFormat { sign_mode: SignMode::Mixed, weight_bits: 8, exponent: 0 }],
        lists: [list(&[2, 4, -6]), list(&[own])].into_iter().collect(),
        axons_in: vec![AxonIn { list: 0, base: 2 }, AxonIn { list: 1, base: 0 }],
        axons_out: vec![AxonOut {
            compartment: CompartmentIdx(7),
            core: CoreId(own as u16 / 2 % 2),
            axon: AxonIdx(1),
        }],
    };
    let slice = |core| Slice { core: CoreId(core), first: CompartmentIdx(2), len: 5 };
    let target = PortTarget { line: 1, core: CoreId(1), axon: AxonIdx(0) };
    CoreMapParts {
        chip: ChipSpec::loihi1(),
        cores: vec![core(2), core(4)],
        populations: vec![Population { name: "p".to_owned(), slices: vec![slice(1), slice(0)] }],
        ports: vec![HostPort { name: "in".to_owned(), lines: 2, targets: vec![target] }],
    }
}

#[test]
fn what_was_packed_is_unpacked_with_its_digest() {
    let written = CoreMap::new(parts()).unwrap();
    let bytes = container::to_bytes(KIND, &File(written.parts().clone()));
    let File(read) = container::from_bytes(KIND, "x.map", &bytes).unwrap();
    assert_eq!(&read, written.parts());
    assert_eq!(CoreMap::new(read).unwrap().digest(), written.digest());
}

#[test]
fn a_list_of_two_cores_is_stored_once_and_changed_for_one() {
    let packed = Packed::of(&parts());
    assert_eq!(packed.lists.0, [0, 1, 0, 2]);
    let mut read = packed.parts().unwrap();
    assert!(std::ptr::eq(&read.cores[0].lists[0], &read.cores[1].lists[0]));
    read.cores[0].lists[0].entries.clear();
    assert_eq!(read.cores[1].lists[0], list(&[2, 4, -6]));
}

#[test]
fn a_bad_list_that_cores_share_is_refused() {
    let mut bad = parts();
    for core in &mut bad.cores {
        core.lists[0].entries[0].format = 3;
    }
    let shared = Packed::of(&bad).parts().unwrap();
    let error = CoreMap::new(shared).unwrap_err();
    assert_eq!(error.to_string(), CoreMap::new(bad).unwrap_err().to_string());
    // Good for the formats of one core, not for those of the other.
    let mut shared = Packed::of(&parts()).parts().unwrap();
    shared.cores[1].formats[0].sign_mode = SignMode::Excitatory;
    let error = CoreMap::new(shared).unwrap_err().to_string();
    assert!(error.starts_with("core 1 (own4), synapse list 0: weight mantissa = -6"), "{error}");
}

/// Error of reading `parts` packed, then changed.
fn error(change: impl FnOnce(&mut Packed)) -> String {
    let mut packed = Packed::of(&parts());
    change(&mut packed);
    packed.parts().unwrap_err()
}

#[test]
fn columns_that_do_not_go_together_are_named() {
    assert_eq!(error(|p| p.cores[1].lists = 3), "synapse lists of cores: 3 more named, 2 there");
    assert_eq!(error(|p| p.cores[1].lists = 1), "synapse lists of cores: 1 more there than named");
    assert_eq!(error(|p| p.lists.0[3] = 3), "synapse list 3 of 3 stored");
    assert_eq!(error(|p| p.cores[0].axons_in = 5), "input axons: 5 more named, 4 there");
    assert_eq!(error(|p| p.axons_in.bases.0.push(1)), "input axons: 1 more there than named");
    assert_eq!(error(|p| p.cores[1].axons_out = 2), "output axons: 2 more named, 1 there");
    assert_eq!(error(|p| p.axons_out.0[2].0.push(1)), "output axons: 1 more there than named");
    assert_eq!(error(|p| p.populations[0].len = 3), "slices of populations: 3 more named, 2 there");
    assert_eq!(error(|p| p.ports[0].targets = 0), "targets of ports: 1 more there than named");
    assert_eq!(error(|p| p.lines.0.clear()), "targets of ports: 1 more named, 0 there");
}

#[test]
fn numbers_of_the_pool_that_do_not_go_together_are_named() {
    assert_eq!(
        error(|p| p.pool.entries.0[2] += 1),
        "formats of synapse entries: 1 more named, 0 there"
    );
    assert_eq!(error(|p| p.pool.formats.0[0] = 256), "synapse format 256");
    assert_eq!(
        error(|p| p.pool.forms.0[1] = pool::SPARSE + 70_000),
        "targets of weights: 70000 more named, 5 there"
    );
    assert_eq!(
        error(|p| p.pool.lens.0[0] = 4_000_000_000),
        "weights: 4000000000 more named, 10 there"
    );
    assert_eq!(error(|p| p.pool.targets.0.push(1)), "targets of weights: 1 more there than named");
}

#[test]
fn a_part_of_a_number_is_refused() {
    let bytes = container::to_bytes(KIND, &Column(vec![1u16, 2, 770]));
    let read: Column<u16> = container::from_bytes(KIND, "x", &bytes).unwrap();
    assert_eq!(read.0, [1, 2, 770]);
    let error = container::from_bytes::<Column<u32>>(KIND, "x", &bytes).unwrap_err();
    assert!(error.to_string().contains("6 bytes of 4-byte numbers"), "{error}");
}
