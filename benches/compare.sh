#!/usr/bin/env bash
# Trains networks for comparison, each from nothing with the same steps in the same rooms, in FOLDER.
# Each command can be killed and run again; it goes on from its last checkpoint.
#
#   benches/compare.sh [FOLDER] [ROW ...]     all variants without events by default
#
# A row is a variant (san, popsan, bdett, laser-only, naive, eem-san), e2e (naive with an encoder that
# learns through the actor), avae or fsvae (naive with another auto-encoder, trained first), told
# (eem-san with an encoder that was told of movers, trained first), or fixed-X and learned-X with
# thresholds of X at the start; -2 or -3 after it is another seed of the actor. All others with events
# take the auto-encoder that ships.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/compare}
shift || true
rows=("$@")
if [ ${#rows[@]} -eq 0 ]; then rows=(san popsan bdett laser-only); fi
cargo build --release
train=(target/release/spikeloop train)
for row in "${rows[@]}"; do
    name=$row
    seed=1
    case $row in
    *-[0-9]) name=${row%-*} seed=${row##*-} ;;
    esac
    encoder=(--encoder src/net/weights/hsvae.safetensors)
    case $name in
    naive | eem-san) what=(--recipe compare --variant "$name" "${encoder[@]}") ;;
    fixed-*) what=(--recipe compare --variant fixed --threshold "${name#*-}" "${encoder[@]}") ;;
    learned-*) what=(--recipe compare --variant eem-san --threshold "${name#*-}" "${encoder[@]}") ;;
    e2e)
        fresh=$out/fresh_encoder
        "${train[@]}" hsvae --config src/train/configs/fresh_encoder.toml --out "$fresh"
        what=(--recipe compare-e2e --encoder "$fresh/hsvae.safetensors")
        ;;
    avae | fsvae)
        "${train[@]}" hsvae --kind "$name" --out "$out/encoder-$name"
        what=(--recipe compare --variant naive --encoder "$out/encoder-$name/$name.safetensors")
        ;;
    told)
        "${train[@]}" hsvae --config src/train/configs/told.toml --out "$out/encoder-told"
        what=(--recipe compare --variant eem-san --encoder "$out/encoder-told/hsvae.safetensors")
        ;;
    *) what=(--recipe compare --variant "$name") ;;
    esac
    "${train[@]}" actor "${what[@]}" --seed "$seed" --out "$out/$row"
done
