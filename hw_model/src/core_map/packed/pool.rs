//! Synapse lists, each distinct one once.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::column::{Column, Reader};
use crate::core_map::Core;
use crate::synapse::{SynapseEntry, SynapseForm, SynapseList};

/// Added to the number of targets where a dense entry has its first target.
pub(super) const SPARSE: u32 = 1 << 16;

/// Lists, their entries and the numbers of these, each one after the other.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Pool {
    /// Entries of each list.
    pub(super) entries: Column<u32>,
    /// Format of each entry.
    pub(super) formats: Column<u16>,
    /// First target of a dense entry, or [`SPARSE`] plus number of targets.
    pub(super) forms: Column<u32>,
    /// Weights of each entry.
    pub(super) lens: Column<u32>,
    pub(super) mantissas: Column<i16>,
    pub(super) targets: Column<u16>,
}

impl Pool {
    /// The distinct lists of all cores in the order in which they occur, and for every list of
    /// every core which one it is.
    pub(super) fn of(cores: &[Core]) -> (Self, Column<u32>) {
        let mut pool = Self::default();
        let mut numbers = BTreeMap::new();
        let mut uses = Vec::new();
        for list in cores.iter().flat_map(|core| &core.lists) {
            let next = numbers.len() as u32;
            let number = *numbers.entry(&list.entries[..]).or_insert(next);
            if number == next {
                pool.add(list);
            }
            uses.push(number);
        }
        (pool, Column(uses))
    }

    fn add(&mut self, list: &SynapseList) {
        self.entries.0.push(list.entries.len() as u32);
        for entry in &list.entries {
            self.formats.0.push(entry.format.into());
            self.lens.0.push(entry.len() as u32);
            self.mantissas.0.extend(entry.mantissas());
            self.forms.0.push(match &entry.form {
                SynapseForm::Dense { first, .. } => u32::from(*first),
                SynapseForm::Sparse { targets, .. } => {
                    self.targets.0.extend(targets);
                    SPARSE + targets.len() as u32
                }
            });
        }
    }

    /// All lists.
    ///
    /// Errors: columns that do not go together.
    pub(super) fn lists(&self) -> Result<Vec<Arc<SynapseList>>, String> {
        let mut formats = Reader::new("formats of synapse entries", &self.formats);
        let mut forms = Reader::new("forms of synapse entries", &self.forms);
        let mut lens = Reader::new("lengths of synapse entries", &self.lens);
        let mut mantissas = Reader::new("weights", &self.mantissas);
        let mut targets = Reader::new("targets of weights", &self.targets);
        let mut entry = || {
            let format = formats.next()?;
            let format = u8::try_from(format).map_err(|_| format!("synapse format {format}"))?;
            let mantissas = mantissas.take(lens.next()? as usize)?.to_vec();
            let form = match forms.next()? {
                first @ ..SPARSE => SynapseForm::Dense { first: first as u16, mantissas },
                sparse => {
                    let targets = targets.take((sparse - SPARSE) as usize)?.to_vec();
                    SynapseForm::Sparse { targets, mantissas }
                }
            };
            Ok::<_, String>(SynapseEntry { format, form })
        };
        let mut lists = Vec::with_capacity(self.entries.0.len());
        for n in &self.entries.0 {
            // Not `collect`, which would reserve what a damaged number asks for.
            let mut entries = Vec::new();
            for _ in 0..*n {
                entries.push(entry()?);
            }
            lists.push(Arc::new(SynapseList { entries }));
        }
        formats.end().and(forms.end()).and(lens.end()).and(mantissas.end()).and(targets.end())?;
        Ok(lists)
    }
}
