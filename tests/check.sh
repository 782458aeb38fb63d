#!/usr/bin/env bash
# Everything that must hold before a change is good: formatting, lints, tests of both crates,
# documentation. Needs a Rust toolchain with rustfmt and clippy, nothing else.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cargo fmt --all --check
cargo clippy --workspace --all-targets --quiet -- -D warnings
cargo test --workspace --quiet
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --quiet
echo "all checks passed"
