#!/usr/bin/env bash
# Speed of the event engine beside plain accumulation of the same weights, as a table.
#
#   benches/speed.sh [FILTER]      FILTER picks benches by name, by default those of the chip
#
# Takes some ten minutes. What criterion says goes to standard error, the table to standard output:
#
#   benches/speed.sh >benches/record/DATE_speed.md
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
filter=${1:-^(chip|rate|state|engines)/}
cargo bench --bench spikeloop -- "$filter" | awk '
    /^# Speed/ { table = 1 }
    table { print; next }
    { print > "/dev/stderr" }'
echo
echo "\`benches/speed.sh '$filter'\`, revision $(git rev-parse --short=12 HEAD)"
