//! Which of the paper's encoders of event frames a network has (tab:svae_compare).

use serde::{Deserialize, Serialize};

/// Kind of an encoder; all have the convolutions of Table 1.
///
/// In weights files it is the tensor `kind` with one number, [`EncoderKind::number`]; there is none
/// for HSVAE.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EncoderKind {
    /// LIF neurons whose state lives for an episode.
    #[default]
    Hsvae,
    /// Artificial: ReLU after all layers but the last, no memory; the readout takes the mean of the
    /// last layer's outputs over the frames of a control tick.
    Avae,
    /// LIF neurons at rest at the start of each control tick.
    Fsvae,
}

impl EncoderKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Hsvae, Self::Avae, Self::Fsvae];

    /// Name in the paper.
    pub fn title(self) -> &'static str {
        match self {
            Self::Hsvae => "HSVAE",
            Self::Avae => "AVAE",
            Self::Fsvae => "FSVAE",
        }
    }

    /// Name in configurations and of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hsvae => "hsvae",
            Self::Avae => "avae",
            Self::Fsvae => "fsvae",
        }
    }

    /// What the tensor `kind` says; `None` where there is no such tensor.
    pub fn number(self) -> Option<f32> {
        match self {
            Self::Hsvae => None,
            Self::Avae => Some(1.0),
            Self::Fsvae => Some(2.0),
        }
    }

    /// Whether its neurons spike.
    pub fn spikes(self) -> bool {
        self != Self::Avae
    }

    /// Whether its state goes on from one control tick to the next.
    pub fn carries(self) -> bool {
        self == Self::Hsvae
    }

    /// Whether it is EEM-SAN's own.
    pub fn is_hsvae(&self) -> bool {
        *self == Self::Hsvae
    }
}
