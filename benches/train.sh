#!/usr/bin/env bash
# Trains what ships, from nothing, in FOLDER: auto-encoder, EEM-SAN and its laser-only control. Both
# begin their last stage with the same actor, which has seen no events.
# Each command can be killed and run again; it goes on from its last checkpoint.
#
#   benches/train.sh [FOLDER] [ROUNDS]      ROUNDS of the last stage, by default those of what ships
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/train}
rounds=${2:-28}
cargo build --release
train() { target/release/spikeloop train "$@"; }

train hsvae --out "$out/hsvae"
train actor --recipe first --out "$out/first"
train actor --recipe second --until 17 --from "$out/first/laser_only.safetensors" --out "$out/second"
train actor --recipe third --until 20 --from "$out/second/laser_only.safetensors" --out "$out/third"
train actor --recipe fourth --until 26 --from "$out/third/laser_only.safetensors" --out "$out/fourth"
before=$out/fourth/laser_only.safetensors
train actor --recipe fifth --until "$rounds" --from "$before" --out "$out/control"
train actor --recipe fifth --until "$rounds" --from "$before" \
    --encoder "$out/hsvae/hsvae.safetensors" --out "$out/eem_san"
