#!/bin/sh
# Instructions per disc and step of features that a scene has not (absent), has but does not use
# (off), and uses (on), counted by valgrind's callgrind. Off may cost LIMIT percent (0.5) more than
# absent: what a scene does not use is not paid for. Exit status: 0, 1 if a feature costs more, 2 if
# a run failed. STEPS=N steps are counted (100).
#
# Rows of gaps are shown only. Absent: neighbours are out of reach; off: near, but apart; on: they
# touch. So much is saved by leaving pairs alone that can't have changed.
set -u
cd "$(dirname "$0")" || exit 2
steps=${STEPS:-100}
limit=${LIMIT:-0.5}
program=build/bench_cost
scene=build/bench_cost.scene

command -v valgrind > /dev/null || { echo 'skipped: valgrind is not installed'; exit 0; }
"./$program" settle "$scene" || exit 2

# Prints "instructions discs contacts lists" of a feature in a state.
count() {
    log=build/bench_cost.log
    numbers=$(valgrind --tool=callgrind --toggle-collect=measured \
        --callgrind-out-file=/dev/null "./$program" "$scene" "$1" "$2" "$steps" 2> "$log") ||
        { cat "$log" >&2; exit 2; }
    echo "$(sed -n 's/.*Collected *: *//p' "$log") $numbers"
}

printf '%-20s %26s   %s\n' '' 'per disc and step' 'per contact and step'
printf '%-20s %8s %8s %8s   %8s %8s %8s   %s   %s\n' feature absent off on absent off on \
    'off - absent' lists
failed=
while read -r feature; do
    absent=$(count "$feature" 0) && off=$(count "$feature" 1) && on=$(count "$feature" 2) || exit 2
    most=$limit
    case $feature in
    gaps*) most=1e9 ;;
    'empty region') most=2 ;; # a list in every step, whose cells share other slots of the table
    esac
    echo $absent $off $on | awk -v name="$feature" -v steps="$steps" -v limit="$most" '
        function per(n, of) { return of > 0 ? sprintf("%8.1f", n / of) : sprintf("%8s", "-") }
        {
            more = 100 * ($5 - $1) / $1
            printf "%-20s %s %s %s   %s %s %s   %+.2f %%   %d, %d, %d\n", name,
                per($1, $2 * steps), per($5, $6 * steps), per($9, $10 * steps),
                per($1, $3 * steps), per($5, $7 * steps), per($9, $11 * steps), more, $4, $8, $12
            exit more > limit
        }' || failed="$failed, $feature"
done << 'END'
friction
friction of no pair
dashpot of no pair
spin
local damping
global damping
gravity
polygons
fixed
wall
segment
empty region
energy, stress
ledger
parallel_for
gaps of discs
gaps of polygons
END

[ -z "$failed" ] && { echo "off costs no more than absent, to $limit %"; exit 0; }
echo "FAILED, off costs more than absent${failed}"
exit 1
