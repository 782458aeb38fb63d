#!/usr/bin/env bash
# What the event engine's counters cost: the same benches by the engine as it is and by one that was
# built without them, in turn, as a table.
#
#   benches/counters.sh [FILTER]      FILTER picks benches by name, by default the networks on one thread
#
# Takes some fifteen minutes, of which building is half. Many short rounds: a neighbour on the machine
# then slows both engines alike. What cargo and criterion say goes to standard error.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
filter=${1:-^chip/.*/event/threads_1\$}
rounds=9

measure() {
    local flags=()
    [ "$1" = with ] || flags=(--target-dir target/uncounted)
    cargo bench --bench spikeloop "${flags[@]}" -- "$filter" \
        --warm-up-time 0.3 --measurement-time 1 --noplot | awk -v engine="$1" '
        /^\| [a-z]+\// { print engine, $2, $4; next }
        { print > "/dev/stderr" }'
}

for round in $(seq $rounds); do
    if [ $((round % 2)) = 1 ]; then
        measure with
        RUSTFLAGS="--cfg uncounted" measure without
    else
        RUSTFLAGS="--cfg uncounted" measure without
        measure with
    fi
done | sort -k1,2 -k3n | awk -v rounds=$rounds '
    { name = $1 " " $2; if (++seen[name] == int((rounds + 1) / 2)) ms[name] = $3 }
    $1 == "with" && seen[name] == 1 { order[++n] = $2 }
    END {
        print "| bench | with counters, ms | without, ms | with / without |"
        print "|---|--:|--:|--:|"
        for (i = 1; i <= n; i++) {
            with = ms["with " order[i]]; without = ms["without " order[i]]
            printf "| %s | %.2f | %.2f | %.3f |\n", order[i], with, without, with / without
        }
    }'
echo
echo "Medians of $rounds runs by either. \`benches/counters.sh '$filter'\`, revision $(git rev-parse --short=12 HEAD)"
