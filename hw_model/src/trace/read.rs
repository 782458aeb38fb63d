//! Reads a trace file.

use std::ops::Range;
use std::sync::Arc;

use super::{Detail, SEPARATOR, STEPS_MAX, Trace, TraceError};
use crate::core_map::{CoreMap, MapReader};
use crate::engine::Stimulus;
use crate::error::TextError;
use crate::spec::ChipSpec;
use crate::text_line::Line;

/// Spikes of one line of a port in consecutive steps.
#[derive(Debug)]
struct Input<'a> {
    steps: Range<u64>,
    port: &'a str,
    port_line: u32,
    at: Line<'a>,
}

/// The part above the separator, under way.
#[derive(Debug, Default)]
struct Head<'a> {
    map: MapReader,
    detail: Option<Detail>,
    inputs: Vec<Input<'a>>,
    steps: Option<usize>,
}

pub(super) fn parse(place: &str, text: &str) -> Result<Trace, TraceError> {
    let is_separator = |line: &&str| line.starts_with("---");
    let above = text.lines().take_while(|line| !is_separator(line));
    let mut head = Head::default();
    let mut last = 1;
    for (index, line) in above.clone().enumerate() {
        last = index + 1;
        if let Some(line) = Line::new(place, last, line) {
            head.line(line)?;
        }
    }
    let separator = text.lines().find(is_separator).unwrap_or(SEPARATOR);
    let head_text: String = above.chain([separator]).flat_map(|line| [line, "\n"]).collect();
    let missing = |what: &str| TextError {
        place: place.to_owned(),
        line: last,
        found: "the end of the input".to_owned(),
        expected: what.to_owned(),
    };
    let steps = head.steps.ok_or_else(|| missing("`run STEPS`"))?;
    let (_, chip) = head.map.chip().ok_or_else(|| missing("`chip NAME`"))?;
    let place = place.to_owned();
    let chip = ChipSpec::named(chip)
        .map_err(|reason| TraceError::Chip { place: place.clone(), reason })?;
    let map = CoreMap::new(head.map.finish(chip))
        .map_err(|e| TraceError::Map { place: place.clone(), reason: Box::new(e) })?;
    Ok(Trace {
        place,
        head: head_text,
        detail: head.detail.unwrap_or(Detail::Compartment),
        stimulus: stimulus(&map, steps, &head.inputs)?,
        expected: text
            .lines()
            .skip_while(|l| !is_separator(l))
            .skip(1)
            .map(str::to_owned)
            .collect(),
        map: Arc::new(map),
    })
}

impl<'a> Head<'a> {
    fn line(&mut self, mut line: Line<'a>) -> Result<(), TextError> {
        let start = line.clone();
        match line.word("a fact")? {
            "detail" => self.detail_line(line),
            "input" => self.input_line(line),
            "run" => self.run_line(line),
            "chip" | "core" | "population" | "port" => self.map.line(start),
            other => {
                let expected =
                    "`chip`, `detail`, `core`, `population`, `port`, `input`, `run` or `---`";
                Err(line.wrong(other, expected))
            }
        }
    }

    fn detail_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let expected = "`compartment` or `step`, once";
        let word = line.word(expected)?;
        let detail = match word {
            "compartment" => Detail::Compartment,
            "step" => Detail::Step,
            _ => return Err(line.wrong(word, expected)),
        };
        match self.detail.replace(detail) {
            None => line.end(),
            Some(_) => Err(line.wrong(word, expected)),
        }
    }

    fn input_line(&mut self, mut line: Line<'a>) -> Result<(), TextError> {
        let at = line.clone();
        let steps = line.clone().value("t", "STEP")?;
        let steps = if steps.contains("..") {
            line.range("t")?
        } else {
            let step: u64 = line.field("t")?;
            step..step.saturating_add(1)
        };
        let port = line.value("port", "NAME")?;
        let port_line = line.field("line")?;
        self.inputs.push(Input { steps, port, port_line, at });
        line.end()
    }

    fn run_line(&mut self, mut line: Line<'_>) -> Result<(), TextError> {
        let expected = format!("a number of steps, at most {STEPS_MAX}, once");
        let word = line.word(&expected)?;
        match line.parse(word, &expected)? {
            steps if steps <= STEPS_MAX && self.steps.is_none() => self.steps = Some(steps),
            _ => return Err(line.wrong(word, &expected)),
        }
        line.end()
    }
}

fn stimulus(map: &CoreMap, steps: usize, inputs: &[Input<'_>]) -> Result<Stimulus, TextError> {
    let mut spikes = Vec::new();
    for input in inputs {
        let Some(port) = map.port(input.port) else {
            return Err(input.at.wrong(input.port, "a port of the map"));
        };
        let lines = map.ports()[port].lines;
        if input.port_line >= lines {
            let found = format!("line={}", input.port_line);
            return Err(input.at.wrong(&found, &format!("a line below {lines}")));
        }
        if input.steps.end > steps as u64 {
            let found = format!("t={}..{}", input.steps.start, input.steps.end);
            return Err(input
                .at
                .wrong(&found, &format!("steps below {steps}, the length of the run")));
        }
        spikes.extend(input.steps.clone().map(|step| (step, port as u32, input.port_line)));
    }
    Ok(Stimulus::new(map, steps, spikes).expect("ports and lines were looked up above"))
}
