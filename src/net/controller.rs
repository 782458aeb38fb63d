//! A network of either kind, for what both can do.

use serde::Serialize;

use crate::net::eem_san::EemSan;
use crate::net::network::Network;

/// A network that can drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Controller {
    /// Laser only, with a rate code and a description file.
    Described(Network),
    /// EEM-SAN or its laser-only control.
    EemSan(Box<EemSan>),
}

impl Controller {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Described(network) => &network.name,
            Self::EemSan(network) => &network.name,
        }
    }

    /// Weights of every spiking layer: the encoder's, then the fully connected ones.
    pub fn weights_mut(&mut self) -> Vec<&mut Vec<f32>> {
        match self {
            Self::Described(network) => {
                network.layers.iter_mut().map(|layer| &mut layer.weights).collect()
            }
            Self::EemSan(network) => network.weights_mut(),
        }
    }

    /// Name and threshold of every fully connected layer; none when thresholds are dynamic.
    pub fn thresholds(&self) -> Vec<(String, f64)> {
        let of = |layer: &crate::net::Layer| (layer.name.clone(), layer.threshold);
        match self {
            Self::Described(network) => network.layers.iter().map(of).collect(),
            Self::EemSan(network) if network.dynamic.is_some() => Vec::new(),
            Self::EemSan(network) => network.dense_layers().map(of).collect(),
        }
    }
}
