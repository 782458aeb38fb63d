//! Tests of the chip model through its public interface, in one binary.

mod container;
mod differential;
mod faults;
mod layouts;
mod limits;
mod map_text;
mod random_map;
mod references;
mod trace_format;
mod traces;
mod vectors;
