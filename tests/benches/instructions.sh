#!/usr/bin/env bash
# Counts the instructions of each case of the benchmark `instructions` with valgrind's callgrind, per call.
# Such counts do not depend on what else the machine does. Cases may be named; without names all are counted.
set -euo pipefail
cd "$(dirname "$0")/../.."

count=100
all=()
built=$(cargo bench --locked --quiet --package axisbridge-tests --bench instructions --no-run --message-format=json)
program=$(grep -o '"executable":"[^"]*/instructions-[^"]*"' <<<"$built" | tail -n 1 | cut -d '"' -f 4)
[ $# -gt 0 ] || mapfile -t all < <("$program" --list)
for case in "$@" "${all[@]}"; do
    # Only what happens inside the function of the case counts.
    counted=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --collect-atstart=no \
        --toggle-collect='instructions::counted_*' "$program" "$case" "$count" 2>&1 | awk '/Collected :/ { print $4 }')
    # Without its name in the program, a function counts nothing.
    [ "${counted:-0}" -gt 0 ] || { echo "error: nothing was counted of $case: expected the symbols in $program" >&2; exit 1; }
    awk -v case="$case" -v counted="$counted" -v count="$count" 'BEGIN { printf "%-30s %10.0f\n", case, counted / count }'
done
