//! Rows of the paper's tables, what they print, and which of our networks stand for them.

use crate::report::success::PAPER;

/// A row of a table.
#[derive(Debug, Clone, Copy)]
pub struct PrintedRow {
    /// What the paper calls it, or what it is here.
    pub label: &'static str,
    /// Built-in networks that stand for it, one for each seed of the training. Those that are not
    /// built in have not been trained.
    pub networks: &'static [&'static str],
    /// Printed success by condition (as in [`crate::evaluate::CONDITIONS`]) and map; `None` where
    /// the paper has no such figure.
    pub printed: [[Option<f64>; 2]; 3],
}

/// A table or figure of success rates.
#[derive(Debug, Clone, Copy)]
pub struct PrintedTable {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Conditions that it covers, by name.
    pub conditions: &'static [&'static str],
    /// Maps that it covers.
    pub maps: &'static [&'static str],
    /// Rows.
    pub rows: &'static [PrintedRow],
    /// Steps between rows whose size is of interest: from, to.
    pub steps: &'static [(usize, usize)],
}

const SAN: &[&str] = &["compare/san", "compare/san-2", "compare/san-3"];
const POPSAN: &[&str] = &["compare/popsan", "compare/popsan-2", "compare/popsan-3"];
const BDETT: &[&str] = &["compare/bdett", "compare/bdett-2", "compare/bdett-3"];
const EEM_SAN: &[&str] = &["compare/eem-san", "compare/eem-san-2", "compare/eem-san-3"];
const LASER_ONLY: &[&str] = &["compare/laser-only", "compare/laser-only-2", "compare/laser-only-3"];
const NAIVE: &[&str] = &["compare/naive", "compare/naive-2", "compare/naive-3"];
const FIXED_0_3: &[&str] = &["compare/fixed-0.3", "compare/fixed-0.3-2", "compare/fixed-0.3-3"];
const LEARNED_0_3: &[&str] =
    &["compare/learned-0.3", "compare/learned-0.3-2", "compare/learned-0.3-3"];
const FIXED_0_5: &[&str] = &["compare/fixed-0.5", "compare/fixed-0.5-2", "compare/fixed-0.5-3"];
const FIXED_0_7: &[&str] = &["compare/fixed-0.7", "compare/fixed-0.7-2", "compare/fixed-0.7-3"];
const LEARNED_0_7: &[&str] =
    &["compare/learned-0.7", "compare/learned-0.7-2", "compare/learned-0.7-3"];

const NOTHING: [[Option<f64>; 2]; 3] = [[None; 2]; 3];

/// Peers and EEM-SAN (tab:2).
pub const SUCCESS: PrintedTable = PrintedTable {
    name: "success",
    title: "Success of the methods (table 2)",
    conditions: &["dynamic-1.0", "static-1.0", "static-0.5"],
    maps: &["map1", "map2"],
    rows: &[
        PrintedRow { label: "SAN", networks: SAN, printed: all(0) },
        PrintedRow { label: "PopSAN", networks: POPSAN, printed: all(1) },
        PrintedRow { label: "BDETT", networks: BDETT, printed: all(2) },
        PrintedRow { label: "EEM-SAN", networks: EEM_SAN, printed: all(3) },
        PrintedRow { label: "laser-only", networks: LASER_ONLY, printed: NOTHING },
        PrintedRow { label: "EEM-SAN, longer", networks: &["eem-san"], printed: NOTHING },
        PrintedRow { label: "laser-only, longer", networks: &["laser-only"], printed: NOTHING },
    ],
    steps: &[(0, 1), (1, 2), (2, 3), (4, 3), (6, 5)],
};

/// Ablation (tab:ab).
pub const ABLATION: PrintedTable = PrintedTable {
    name: "ablation",
    title: "Ablation (table 3)",
    conditions: &["dynamic-1.0"],
    maps: &["map1"],
    rows: &[
        PrintedRow { label: "(a) PopSAN", networks: POPSAN, printed: one(0.598) },
        PrintedRow {
            label: "(b) E2E, addition",
            networks: &["compare/e2e", "compare/e2e-2", "compare/e2e-3"],
            printed: one(0.705),
        },
        PrintedRow { label: "(c) HSVAE, addition", networks: NAIVE, printed: one(0.728) },
        PrintedRow { label: "(d) HSVAE, MFDM-LT", networks: EEM_SAN, printed: one(0.765) },
    ],
    steps: &[(0, 1), (1, 2), (2, 3)],
};

/// Encoders (svae_compare), with addition as in row (c) of the ablation.
pub const ENCODERS: PrintedTable = PrintedTable {
    name: "encoders",
    title: "Encoders of event frames (table 4)",
    conditions: &["dynamic-1.0"],
    maps: &["map1"],
    rows: &[
        PrintedRow {
            label: "AVAE",
            networks: &["compare/avae", "compare/avae-2", "compare/avae-3"],
            printed: one(0.677),
        },
        PrintedRow {
            label: "FSVAE",
            networks: &["compare/fsvae", "compare/fsvae-2", "compare/fsvae-3"],
            printed: one(0.673),
        },
        PrintedRow { label: "HSVAE", networks: NAIVE, printed: one(0.728) },
    ],
    steps: &[(0, 2), (1, 2)],
};

/// Learnable against fixed thresholds (fig:5); the paper prints no figures.
pub const THRESHOLDS: PrintedTable = PrintedTable {
    name: "thresholds",
    title: "Learnable against fixed thresholds, by their initial value (figure 5)",
    conditions: &["dynamic-1.0"],
    maps: &["map1"],
    rows: &[
        PrintedRow { label: "fixed, 0.3", networks: FIXED_0_3, printed: NOTHING },
        PrintedRow { label: "learned, 0.3", networks: LEARNED_0_3, printed: NOTHING },
        PrintedRow { label: "fixed, 0.5", networks: FIXED_0_5, printed: NOTHING },
        PrintedRow { label: "learned, 0.5", networks: EEM_SAN, printed: NOTHING },
        PrintedRow { label: "fixed, 0.7", networks: FIXED_0_7, printed: NOTHING },
        PrintedRow { label: "learned, 0.7", networks: LEARNED_0_7, printed: NOTHING },
        PrintedRow { label: "fixed, 0.9", networks: &["compare/fixed-0.9"], printed: NOTHING },
        PrintedRow { label: "learned, 0.9", networks: &["compare/learned-0.9"], printed: NOTHING },
    ],
    steps: &[(0, 1), (2, 3), (4, 5), (6, 7)],
};

/// All tables of success rates.
pub const TABLES: [PrintedTable; 4] = [SUCCESS, ABLATION, ENCODERS, THRESHOLDS];

/// A row of [`PAPER`].
const fn all(row: usize) -> [[Option<f64>; 2]; 3] {
    let rates = PAPER[row].1;
    let mut printed = [[None; 2]; 3];
    let mut at = 0;
    while at < 6 {
        printed[at / 2][at % 2] = Some(rates[at / 2][at % 2]);
        at += 1;
    }
    printed
}

/// Map 1 with movers, and nothing else.
const fn one(rate: f64) -> [[Option<f64>; 2]; 3] {
    let mut printed = [[None; 2]; 3];
    printed[0][0] = Some(rate);
    printed
}
