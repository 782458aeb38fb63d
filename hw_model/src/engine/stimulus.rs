//! What the host injects, step by step.

use thiserror::Error;

use crate::core_map::CoreMap;

/// Spikes for the ports of a map, by step. A line spikes at most once per step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stimulus {
    /// Spikes of step `t` are `spikes[starts[t]..starts[t + 1]]`.
    starts: Vec<usize>,
    /// (port, line), sorted within a step, none twice.
    spikes: Vec<(u32, u32)>,
}

/// A spike that the map has no place for.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum StimulusError {
    /// The port has fewer lines.
    #[error("input spike at step {step}: line {line} of port {port}, but it has {lines} lines")]
    Line {
        /// Step of the spike.
        step: u64,
        /// Name of the port.
        port: String,
        /// Line asked for.
        line: u32,
        /// Lines there are.
        lines: u32,
    },
    /// The map has fewer ports.
    #[error("input spike at step {step}: port {port}, but the map has {ports} ports")]
    Port {
        /// Step of the spike.
        step: u64,
        /// Port asked for.
        port: u32,
        /// Ports there are.
        ports: usize,
    },
}

impl Stimulus {
    /// No input for `steps` steps.
    pub fn silent(steps: usize) -> Self {
        Self { starts: vec![0; steps + 1], spikes: Vec::new() }
    }

    /// Spikes as (step, port, line) in any order; those at or after `steps` are left out, and a
    /// repeated one counts once.
    ///
    /// Errors: a port or line that `map` does not have.
    pub fn new(
        map: &CoreMap,
        steps: usize,
        spikes: impl IntoIterator<Item = (u64, u32, u32)>,
    ) -> Result<Self, StimulusError> {
        let mut sorted: Vec<(u64, u32, u32)> = Vec::new();
        for (step, port, line) in spikes {
            let Some(there) = map.ports().get(port as usize) else {
                return Err(StimulusError::Port { step, port, ports: map.ports().len() });
            };
            if line >= there.lines {
                let (port, lines) = (there.name.clone(), there.lines);
                return Err(StimulusError::Line { step, port, line, lines });
            }
            if step < steps as u64 {
                sorted.push((step, port, line));
            }
        }
        sorted.sort_unstable();
        sorted.dedup();
        let starts = (0..=steps as u64).map(|t| sorted.partition_point(|s| s.0 < t)).collect();
        Ok(Self {
            starts,
            spikes: sorted.into_iter().map(|(_, port, line)| (port, line)).collect(),
        })
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.starts.len() - 1
    }

    /// The steps of `range` alone, numbered from 0. Panics when there are fewer steps.
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let starts = &self.starts[range.start..=range.end];
        let (first, end) = (starts[0], starts[range.len()]);
        Self {
            starts: starts.iter().map(|start| start - first).collect(),
            spikes: self.spikes[first..end].to_vec(),
        }
    }

    /// (port, line) of every spike injected in step `step`, sorted.
    pub fn at(&self, step: usize) -> &[(u32, u32)] {
        &self.spikes[self.starts[step]..self.starts[step + 1]]
    }
}
