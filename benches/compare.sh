#!/usr/bin/env bash
# Trains networks for comparison, each from nothing with the same steps in the same rooms, in FOLDER;
# those with events need the auto-encoder of benches/train.sh or the one that ships.
# Each command can be killed and run again; it goes on from its last checkpoint.
#
#   benches/compare.sh [FOLDER] [VARIANT ...]     all variants without events by default
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/compare}
shift || true
variants=("$@")
if [ ${#variants[@]} -eq 0 ]; then variants=(san popsan bdett laser-only); fi
cargo build --release
for variant in "${variants[@]}"; do
    encoder=()
    case $variant in
    naive | fixed | eem-san) encoder=(--encoder src/net/weights/hsvae.safetensors) ;;
    esac
    target/release/spikeloop train actor --recipe compare --variant "$variant" "${encoder[@]}" \
        --out "$out/$variant"
done
