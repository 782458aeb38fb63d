//! The lists of a core, which may lie in memory once for several cores.

use std::ops::{Index, IndexMut};
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::SynapseList;

/// Stored synapse lists of a core; a position is what [`crate::core_map::AxonIn::list`] names.
///
/// A list that is changed becomes a list of its own. Serialized it is a plain sequence.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SynapseLists(Vec<Arc<SynapseList>>);

impl SynapseLists {
    /// Number of lists.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a list.
    pub fn push(&mut self, list: SynapseList) {
        self.0.push(Arc::new(list));
    }

    /// All lists in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &SynapseList> + Clone {
        self.0.iter().map(Arc::as_ref)
    }

    /// The same to change; each becomes a list of its own.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut SynapseList> {
        self.0.iter_mut().map(Arc::make_mut)
    }

    /// These lists, each of which others may have as well.
    pub(crate) fn of_shared(lists: Vec<Arc<SynapseList>>) -> Self {
        Self(lists)
    }
}

impl Index<usize> for SynapseLists {
    type Output = SynapseList;

    fn index(&self, list: usize) -> &SynapseList {
        &self.0[list]
    }
}

impl IndexMut<usize> for SynapseLists {
    fn index_mut(&mut self, list: usize) -> &mut SynapseList {
        Arc::make_mut(&mut self.0[list])
    }
}

impl FromIterator<SynapseList> for SynapseLists {
    fn from_iter<I: IntoIterator<Item = SynapseList>>(lists: I) -> Self {
        Self(lists.into_iter().map(Arc::new).collect())
    }
}

impl From<Vec<SynapseList>> for SynapseLists {
    fn from(lists: Vec<SynapseList>) -> Self {
        lists.into_iter().collect()
    }
}

impl<'a> IntoIterator for &'a SynapseLists {
    type Item = &'a SynapseList;
    type IntoIter = std::iter::Map<
        std::slice::Iter<'a, Arc<SynapseList>>,
        fn(&'a Arc<SynapseList>) -> &'a SynapseList,
    >;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter().map(Arc::as_ref)
    }
}

impl Serialize for SynapseLists {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for SynapseLists {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::<SynapseList>::deserialize(deserializer).map(Self::from)
    }
}
