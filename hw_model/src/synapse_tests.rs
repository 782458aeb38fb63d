use super::*;
use crate::weight::SignMode;

fn packing(rule: PackingRule) -> Packing {
    Packing { rule, delay_bits: 0, tag_bits: 0 }
}

fn list(form: SynapseForm) -> SynapseList {
    SynapseList { entries: vec![SynapseEntry { format: 0, form }] }
}

const FORMATS: [SynapseFormat; 1] =
    [SynapseFormat { sign_mode: SignMode::Mixed, weight_bits: 8, exponent: 0 }];

#[test]
fn dense_256_takes_36_words_by_the_nengo_rule() {
    let dense = list(SynapseForm::Dense { first: 0, mantissas: vec![2; 256] });
    assert_eq!(dense.words(&FORMATS, &packing(PackingRule::Nengo), 256), 36);
}

#[test]
fn dense_256_by_the_nxtf_rule() {
    // 5 entries of at most 60: 5 * (10 + 8) + 256 * 8 = 2138 bit = 34 words; rest 26, no spare.
    let dense = list(SynapseForm::Dense { first: 0, mantissas: vec![2; 256] });
    assert_eq!(dense.words(&FORMATS, &packing(PackingRule::Nxtf), 256), 34);
}

#[test]
fn sparse_synapses_pay_for_their_index() {
    let sparse = list(SynapseForm::Sparse { targets: (0..60).collect(), mantissas: vec![2; 60] });
    // 10 + 60 * (8 + 7) = 910 bit = 15 words, rest 14.
    assert_eq!(sparse.words(&FORMATS, &packing(PackingRule::Nxtf), 128), 15);
    assert_eq!(sparse.words(&FORMATS, &packing(PackingRule::Nengo), 128), 15);
}

#[test]
fn a_full_last_word_costs_a_spare_one_by_the_nxtf_rule() {
    // 10 + 6 (index) + 6 * 8 = 64 bit exactly.
    let dense = list(SynapseForm::Dense { first: 0, mantissas: vec![2; 6] });
    assert_eq!(dense.words(&FORMATS, &packing(PackingRule::Nxtf), 64), 2);
    assert_eq!(dense.words(&FORMATS, &packing(PackingRule::Nengo), 64), 1);
}

#[test]
fn an_empty_list_takes_no_memory() {
    for rule in [PackingRule::Nxtf, PackingRule::Nengo] {
        assert_eq!(SynapseList::default().words(&FORMATS, &packing(rule), 64), 0);
    }
}
