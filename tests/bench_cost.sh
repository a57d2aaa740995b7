#!/bin/sh
# Instructions per particle and step, counted by valgrind's callgrind; usage:
#
#   bench_cost.sh features   of features that a scene has not (absent), has but does not use (off),
#                            and uses (on). Off may cost LIMIT percent (0.5) more than absent: what a
#                            scene does not use is not paid for. STEPS=N steps are counted (100).
#   bench_cost.sh guard COMPILER...
#                            of fixed scenes, and bytes of text of the header, beside the figures in
#                            bench_guard.txt, which see. RENEW=1 WHY=TEXT writes them there. Scenes
#                            are settled by the first compiler's program: all have the same bits.
#
# The programs are build/bench_cost and build/bench_cost_COMPILER; FLAGS are for the compilers. Exit
# status: 0, 1 if something costs more, 2 if a run failed.
set -u
cd "$(dirname "$0")" || exit 2
program=build/bench_cost
FLAGS=${FLAGS:--std=c99 -ffp-contract=off -I.. -O2}

command -v valgrind > /dev/null || { echo 'skipped: valgrind is not installed'; exit 0; }

# Prints "instructions particles contacts lists" of a run of the program.
count() {
    log=build/bench_cost.log
    numbers=$(valgrind --tool=callgrind --toggle-collect=measured \
        --callgrind-out-file=/dev/null "./$program" "$@" 2> "$log") ||
        { cat "$log" >&2; exit 2; }
    echo "$(sed -n 's/.*Collected *: *//p' "$log") $numbers"
}

# --- features ------------------------------------------------------------------------------------

# Rows of gaps are shown only. Absent: neighbours are out of reach; off: near, but apart; on: they
# touch. So much is saved by leaving pairs alone that can't have changed.
features() {
    steps=${STEPS:-100}
    limit=${LIMIT:-0.5}
    saved=build/bench_cost.scene
    "./$program" settle 'smooth discs' 1 "$saved" || exit 2

    printf '%-20s %26s   %s\n' '' 'per disc and step' 'per contact and step'
    printf '%-20s %8s %8s %8s   %8s %8s %8s   %s   %s\n' feature absent off on absent off on \
        'off - absent' lists
    failed=
    while read -r feature; do
        absent=$(count feature "$saved" "$feature" 0 "$steps") &&
            off=$(count feature "$saved" "$feature" 1 "$steps") &&
            on=$(count feature "$saved" "$feature" 2 "$steps") || exit 2
        most=$limit
        case $feature in
        gaps*) most=1e9 ;;
        # A list in every step. Where grains are far apart, cells share a hash table, which takes a
        # sixth more than rows of cells (2,194 against 1,877 instructions; 3,044 before there were
        # rows): at three lists in a hundred steps 9.5 instructions of 317 a step.
        'empty region') most=20 ;;
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
fields
ledger
parallel_for
cell
gaps of discs
gaps of polygons
END

    [ -z "$failed" ] && { echo "off costs no more than absent, to $limit %"; exit 0; }
    echo "FAILED, off costs more than absent${failed}"
    exit 1
}

# --- guard ---------------------------------------------------------------------------------------

# Compiler, its major version, the machine, and the paths that the library was made to take: as it
# chooses by itself. Paths with vectors, once there are any, are rows of keys of their own, and
# bench_cost takes the path as an argument.
key() {
    case $("$1" --version 2> /dev/null | head -n 1) in
    *clang*) name=clang ;;
    *) name=gcc ;;
    esac
    echo "$name-$("$1" -dumpversion | cut -d. -f1)-$("$1" -dumpmachine | cut -d- -f1)-own"
}

# Prints "ROW | figure" for the instructions of a scene, which is settled first, in some steps.
instructions() {
    saved="build/bench_guard/$1"
    [ -e "$saved" ] || "./$program" settle "$1" 1 "$saved" || exit 2
    counted=$(count go-on "$saved" "$2") || exit 2
    echo $counted | awk -v row="$1" -v steps="$2" \
        '{ printf "%s | %.*f\n", row, $1 / $2 / steps < 1000, $1 / $2 / steps }'
}

# Prints "ROW | figure" for the bytes of text of the program on stdin.
text() {
    cat > build/bench_guard.c
    "$compiler" $FLAGS -c build/bench_guard.c -o build/bench_guard.o || exit 2
    echo "$1 | $(size build/bench_guard.o | awk 'NR == 2 { print $1 }')"
}

# Steps are as many as the figure needs to be the same, to 1 %, for other draws of the grains.
figures() {
    instructions 'discs' 2000
    instructions 'discs, dashpot' 500
    instructions 'discs, dashpot, rolling' 500
    instructions 'discs, law' 500
    instructions 'discs, short law' 500
    instructions 'polygons' 300
    instructions 'ellipses' 300
    instructions 'polybeziers' 300
    instructions 'Fourier series' 300
    instructions 'mixed' 300
    instructions 'moving discs' 2000
    instructions 'segments' 300
    instructions 'cell' 500
    text 'text: one pair query' << 'END'
#define DEM2D_STATIC
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
dem2d_result query(const dem2d_shape *a, const dem2d_shape *b, dem2d_contact *c);
dem2d_result query(const dem2d_shape *a, const dem2d_shape *b, dem2d_contact *c) {
    return dem2d_pair_contact(a, dem2d_pose_make(0, 0, 0, 1), b, dem2d_pose_make(1, 0, 0, 1), NULL, c);
}
END
    text 'text: a world of discs' << 'END'
#define DEM2D_STATIC
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
int run(const dem2d_world_desc *scene, const dem2d_material_desc *stone,
        const dem2d_wall_desc *wall, dem2d_particle_desc *grain);
int run(const dem2d_world_desc *scene, const dem2d_material_desc *stone,
        const dem2d_wall_desc *wall, dem2d_particle_desc *grain) {
    dem2d_world *world;
    dem2d_shape *disc;
    dem2d_wall_id floor;
    dem2d_particle_id id;
    dem2d_particle_info info;
    int bad = dem2d_world_create(scene, &world) || dem2d_shape_create_circle(NULL, 1, &disc) ||
              dem2d_world_add_shape(world, disc, &grain->shape) ||
              dem2d_world_add_material(world, stone, &grain->material) ||
              dem2d_world_add_wall(world, wall, &floor) ||
              dem2d_world_add_particle(world, grain, &id) ||
              dem2d_world_step(world, 1000, NULL) || dem2d_world_get_particle(world, id, &info);
    dem2d_shape_destroy(disc);
    dem2d_world_destroy(world);
    return bad;
}
END
    text 'text: everything' << 'END'
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
END
}

guard() {
    worst=0
    rm -rf build/bench_guard
    mkdir -p build/bench_guard || exit 2
    for compiler; do
        program=build/bench_cost_$compiler
        figures > build/bench_guard.out || exit 2
        awk -v key="$(key "$compiler")" -v renew="${RENEW:-}" -v why="${WHY:-}" \
            -f bench_guard.awk bench_guard.txt build/bench_guard.out || worst=1
        [ ! -e build/bench_guard.txt ] || mv build/bench_guard.txt bench_guard.txt
    done
    exit "$worst"
}

case ${1:-} in
features) features ;;
guard)
    shift
    guard "$@"
    ;;
*)
    echo 'usage: bench_cost.sh features | guard COMPILER...' >&2
    exit 2
    ;;
esac
