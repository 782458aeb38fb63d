#!/usr/bin/env bash
# SAN's published weights in its own evaluation world, float and chip, beside published numbers.
#
#   benches/published.sh [FOLDER]      FOLDER holds SAN's weights, worlds and pairs
#
# Takes a few minutes. The results in the README come from its output in benches/record/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
san=${1:-../shared/data/san}
cargo build --release --quiet
spikeloop=target/release/spikeloop
maps=$(mktemp -d)
trap 'rm -rf "$maps"' EXIT
weights="$san/san_sddpg_bw5.safetensors"
world=(--arena "$san/san_evaluation_world.json" --pairs "$san/san_eval_positions.json")

section() { printf '\n## %s\n\n' "$1"; }

echo "# SAN on the emulated chip"
section "Core map, SAN's published scaling"
"$spikeloop" compile san --weights "$weights" --policy san -o "$maps/san.map" | grep -v '^wrote'
"$spikeloop" compile san --weights "$weights" --policy nearest -o "$maps/nearest.map" >/dev/null

section "Three seeds, v_max 0.5 m/s, ideal actuators (published: 198 of 200, 18.54 m, 42.5 s)"
"$spikeloop" drive san "$maps/san.map" "$maps/nearest.map" straight --weights "$weights" \
    "${world[@]}" --repeats 3

section "Whole commands on this machine ($(nproc) cores), seconds of wall-clock time"
TIMEFORMAT='%1R s'
clock() { printf '%-28s' "$1"; shift; time "$@" >/dev/null; }
clock "float, 200 trials" "$spikeloop" drive san --weights "$weights" "${world[@]}" 2>&1
clock "chip, event, 200 trials" "$spikeloop" drive "$maps/san.map" "${world[@]}" 2>&1
clock "chip, event, 10 trials" "$spikeloop" drive "$maps/san.map" "${world[@]}" --trials 10 2>&1
clock "chip, dense, 10 trials" \
    "$spikeloop" drive "$maps/san.map" "${world[@]}" --trials 10 --engine dense 2>&1

section "Actuator lag and speed"
for v_max in 0.5 1.0; do
    for actuators in ideal lag lag-0.4 lag-split-a lag-split-b; do
        "$spikeloop" drive san "$maps/san.map" --weights "$weights" "${world[@]}" \
            --v-max "$v_max" --actuators "$actuators" | grep -E '^arena|^\| (driver|-|san)' | head -4
    done
done

section "BDETT's arena without its moving obstacles, then with them"
for still in --static ""; do
    for v_max in 0.5 1.0; do
        # shellcheck disable=SC2086
        "$spikeloop" drive san "$maps/san.map" --weights "$weights" \
            --arena "$san/bdett_dynamic_world.json" --pairs "$san/san_eval_positions.json" \
            --v-max "$v_max" $still | grep -E '^arena|^\| (driver|-|san)' | head -4
    done
done
