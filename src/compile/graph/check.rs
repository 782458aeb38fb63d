//! Whether the parts of a graph go together.

use super::{GraphPopulation, IntegerGraph, Mantissas, Projection, Source};
use crate::compile::error::CompileError;
use crate::net::conv2d::Shape;

impl IntegerGraph {
    /// Shape of each population: that of the convolutions onto it, or one pixel of as many
    /// channels as it has neurons.
    ///
    /// Errors: parts of the graph that do not go together, with the place and both sizes.
    pub fn shapes(&self) -> Result<Vec<Shape>, CompileError> {
        let mut shapes: Vec<Option<Shape>> = vec![None; self.populations.len()];
        for (index, projection) in self.projections.iter().enumerate() {
            let wrong = |problem: String| CompileError::Graph {
                place: format!("projection {index}"),
                problem,
            };
            let rows = self.check_projection(projection).map_err(wrong)?;
            self.check_sources(projection, rows).map_err(wrong)?;
            if let Mantissas::Conv(conv, _) = &projection.mantissas {
                let shape = shapes[projection.target].get_or_insert(conv.output());
                if *shape != conv.output() {
                    return Err(wrong(format!("gives {}, another gives {shape}", conv.output())));
                }
            }
        }
        for population in &self.populations {
            population.check()?;
        }
        let flat = |(shape, about): (Option<Shape>, &GraphPopulation)| {
            shape.unwrap_or_else(|| Shape::flat(about.neurons))
        };
        Ok(shapes.into_iter().zip(&self.populations).map(flat).collect())
    }

    /// Units that a projection takes from each of its sources.
    fn check_projection(&self, projection: &Projection) -> Result<usize, String> {
        let Some(target) = self.populations.get(projection.target) else {
            let (target, there) = (projection.target, self.populations.len());
            return Err(format!("onto population {target}, there are {there}"));
        };
        let stored = projection.mantissas.values().len();
        match &projection.mantissas {
            Mantissas::Dense(_)
                if target.neurons == 0 || !stored.is_multiple_of(target.neurons) =>
            {
                Err(format!("{stored} weights are no rows for {} neurons", target.neurons))
            }
            Mantissas::Dense(_) => Ok(stored / target.neurons),
            Mantissas::Conv(conv, _) if stored != conv.n_weights() => {
                Err(format!("{stored} weights, the kernel has {:?}", conv.weights_shape()))
            }
            Mantissas::Conv(conv, _) if conv.output().neurons() != target.neurons => {
                let (output, neurons) = (conv.output(), target.neurons);
                Err(format!("gives {output}, but {} has {neurons} neurons", target.name))
            }
            Mantissas::Conv(conv, _) => Ok(conv.input().neurons()),
        }
    }

    fn check_sources(&self, projection: &Projection, rows: usize) -> Result<(), String> {
        if projection.sources.is_empty() {
            return Err("has no source".to_owned());
        }
        for source in &projection.sources {
            let units = match source {
                Source::Port(port) => self.ports.get(*port).map(|port| port.1),
                Source::Population(from) => self.populations.get(*from).map(|p| p.neurons),
            };
            let end = projection.first_source.saturating_add(rows);
            match units {
                None => return Err(format!("from {source:?}, which is not there")),
                Some(units) if units < end => {
                    return Err(format!("takes units up to {end} of {source:?}, it has {units}"));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }
}

impl GraphPopulation {
    fn check(&self) -> Result<(), CompileError> {
        let (neurons, biases) = (self.neurons, self.bias.mantissas.len());
        let problem = if neurons == 0 {
            "has no neurons".to_owned()
        } else if biases > 0 && !neurons.is_multiple_of(biases) {
            format!("{biases} biases for {neurons} neurons; give 1, one per channel or per neuron")
        } else {
            return Ok(());
        };
        Err(CompileError::Graph { place: format!("population {}", self.name), problem })
    }
}
