#!/usr/bin/env bash
# Trains what ships, from nothing, in FOLDER: auto-encoder, EEM-SAN and its laser-only control.
# Each command can be killed and run again; it goes on from its last checkpoint.
#
#   benches/train.sh [FOLDER] [ROUNDS]      ROUNDS of the third stage, by default those of what ships
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/train}
rounds=${2:-20}
cargo build --release
train() { target/release/spikeloop train "$@"; }

train hsvae --out "$out/hsvae"
train actor --recipe first --out "$out/first"
encoder=$out/hsvae/hsvae.safetensors
first=$out/first/laser_only.safetensors
train actor --recipe second --rounds 17 --from "$first" --encoder "$encoder" --out "$out/second"
train actor --recipe second --rounds 17 --from "$first" --out "$out/second_control"
train actor --recipe third --rounds "$rounds" --from "$out/second/eem_san.safetensors" \
    --encoder "$encoder" --out "$out/third"
train actor --recipe third --rounds "$rounds" --from "$out/second_control/laser_only.safetensors" \
    --out "$out/third_control"
