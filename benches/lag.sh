#!/usr/bin/env bash
# Trains EEM-SAN and its laser-only control on for robots whose wheels lag, from what ships for ideal
# ones, in FOLDER. Each command can be killed and run again; it goes on from its last checkpoint.
#
#   benches/lag.sh [FOLDER]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/lag}
cargo build --release
weights=src/net/weights
train=(target/release/spikeloop train actor --recipe fifth --seed 2 --until 20 --actuators lag)
"${train[@]}" --from "$weights/laser_only.safetensors" --out "$out/laser_only"
"${train[@]}" --from "$weights/eem_san.safetensors" --encoder "$weights/hsvae.safetensors" \
    --out "$out/eem_san"
for name in laser_only eem_san; do
    target/release/spikeloop halve "$out/$name/$name.safetensors" -o "$out/$name.safetensors"
done
