#!/bin/sh
# Compiles dem2d.h in every language it promises, by gcc and clang (what is skipped is said), all
# warnings as errors, links what came out and runs it. One line for each combination; the sources
# it writes and the logs are in build/matrix. JOBS=N workers (default: processors, at most 4).
# Warnings of clang do not depend on the level, those of gcc do; neither's on the standard's year. So
# by default newer standards are parsed only, and gcc and g++ alone build at -O2; LONG=1: all do.
set -u
cd "$(dirname "$0")" || exit 1
out=build/matrix
rm -rf "$out"
mkdir -p "$out" || exit 1

warnings='-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wundef
    -Wdouble-promotion -Wcast-qual -Wvla -Wswitch-enum -Wmissing-declarations -Wfloat-conversion
    -Wcast-align -Wwrite-strings -Wformat=2 -Werror'
warnings_c='-Wmissing-prototypes -Wstrict-prototypes'

# --- sources -----------------------------------------------------------------------------------

# The header as a program would have it: declarations, then the implementation, then both again.
cat > "$out/implementation.c" << 'END'
#include "dem2d.h"
#include "dem2d.h"
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#include "dem2d.h"
END

# The other order, and the macro gone in between.
cat > "$out/reverse.c" << 'END'
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
#undef DEM2D_IMPLEMENTATION
#include "dem2d.h"
#define DEM2D_IMPLEMENTATION
#include "dem2d.h"
END

# A user of the declarations; `use` returns 0 when all went well.
cat > "$out/use.h" << 'END'
#include "dem2d.h"
#include "dem2d.h"

static int use(void) {
    dem2d_world_desc scene = {0};
    dem2d_material_desc stone = {0};
    dem2d_particle_desc grain = {0};
    dem2d_world *world = NULL;
    dem2d_shape *disc = NULL;
    dem2d_contact contact;
    int done = 0;
    scene.time_step = 1e-4;
    scene.gravity.y = -9.81;
    stone.density = 2700;
    stone.normal_stiffness = 1e7;
    grain.scale = 1;
    if (dem2d_version() != DEM2D_VERSION) return 1;
    if (dem2d_shape_create_circle(NULL, 0.5, &disc) != DEM2D_OK) return 2;
    if (dem2d_pair_contact(disc, dem2d_pose_make(0, 0, 0, 1), disc, dem2d_pose_make(0, 0.75, 1, 1),
                           NULL, &contact) != DEM2D_OK)
        return 3;
    if (contact.state != DEM2D_PENETRATING) return 4;
    if (!(contact.depth > 0.2499 && contact.depth < 0.2501)) return 4;
    if (dem2d_world_create(&scene, &world) != DEM2D_OK) return 5;
    if (dem2d_world_add_shape(world, disc, &grain.shape) != DEM2D_OK) return 6;
    if (dem2d_world_add_material(world, &stone, &grain.material) != DEM2D_OK) return 7;
    {
        dem2d_particle_id id;
        if (dem2d_world_add_particle(world, &grain, &id) != DEM2D_OK) return 8;
    }
    if (dem2d_world_step(world, 10, &done) != DEM2D_OK || done != 10) return 9;
    dem2d_world_destroy(world);
    dem2d_shape_destroy(disc);
    return 0;
}
END

cat > "$out/main.c" << 'END'
#include "use.h"
int main(void) { return use(); }
END

cat > "$out/reverse_main.c" << 'END'
#include "reverse.c"
#include "use.h"
int main(void) { return use(); }
END

# Two units with a private implementation each.
cat > "$out/static_main.c" << 'END'
#define DEM2D_STATIC
#define DEM2D_IMPLEMENTATION
#include "use.h"
int other(void);
int main(void) { return use() ? 1 : other(); }
END
cat > "$out/static_other.c" << 'END'
#define DEM2D_STATIC
#define DEM2D_IMPLEMENTATION
#include "use.h"
int other(void);
int other(void) { return use(); }
END

for f in implementation main reverse_main static_main static_other; do
    cp "$out/$f.c" "$out/$f.cpp"
done

# The program of README.md, if there is one.
if [ -f ../README.md ]; then
    awk '/^```/ { on = /^```c$/; next } on' ../README.md > "$out/readme.c"
fi

# --- one combination: NAME KIND COMPILER STANDARD LEVEL ----------------------------------------

# Compile, link and run; the log tells where it failed.
combination() {
    kind=$1 compiler=$2 standard=$3 level=$4
    work=$out/$(echo "$kind.$compiler.$standard.$level" | tr '+' 'p')
    mkdir -p "$work"
    case $compiler in
    *++) more='-Wno-missing-field-initializers' end=cpp ;; # {0} is what the manual recommends
    *) more=$warnings_c end=c ;;
    esac
    compile="$compiler -std=$standard $level $warnings $more -I.. -I$out -c"
    case $kind in
    two-files) sources='implementation main' ;;
    one-file) sources='reverse_main' ;;
    static) sources='static_main static_other' ;;
    readme) sources='readme' ;;
    mixed) sources='main' ;; # main in C++, the implementation in C
    fast-math)
        refused "$compiler -std=$standard $level -I.. -E $out/implementation.$end -o $work/refused.i" \
            "${level#-f}"
        return
        ;;
    contraction)
        contraction "$compiler" "$standard" "$level" "$work"
        return
        ;;
    parse)
        $compile "$out/implementation.$end"
        return
        ;;
    windows)
        $compile "$out/implementation.$end" -o "$work/implementation.o"
        return
        ;;
    esac
    objects=
    if [ "$kind" = mixed ]; then
        objects=$work/implementation.o
        gcc -std=c99 "$level" -I.. -c "$out/implementation.c" -o "$objects" || return 1
    fi
    for source in $sources; do
        $compile "$out/$source.$end" -o "$work/$source.o" || return 1
        objects="$objects $work/$source.o"
    done
    $compiler $objects -o "$work/program" -lm || return 1
    (cd "$work" && ./program) || { echo "the program returned $?"; return 1; }
    if [ "$kind" = two-files ]; then exports "$work/implementation.o" || return 1; fi
}

# The compiler must say no, and the reason must be the header's own. What -funsafe-math-optimizations
# brings with it is told by another name.
refused() {
    name=$2
    [ "$name" = unsafe-math-optimizations ] && name=associative-math
    if text=$($1 2>&1); then
        echo "compiled with -f$2"
        return 1
    fi
    echo "$text"
    echo "$text" | grep -i 'error' | grep -q "dem2d.h: -f$name"
}

# The lines of the header that set clang's contraction, and set it back, on all of its targets: no
# warning; off between them; behind them as before, whatever the command line says.
contraction() {
    sources=$4/contraction.${2%%[0-9]*}
    {
        echo 'double before(double a, double b, double c);'
        echo 'double inside(double a, double b, double c);'
        echo 'double after(double a, double b, double c);'
        echo 'double before(double a, double b, double c) { return a * b + c; }'
        pragma_lines 1
        echo 'double inside(double a, double b, double c) { return a * b + c; }'
        pragma_lines 2
        echo 'double after(double a, double b, double c) { return a * b + c; }'
    } > "$sources"
    for target in x86_64-linux-gnu i686-linux-gnu aarch64-linux-gnu arm-linux-gnueabihf riscv32 \
        riscv64 wasm32 mips mips64 powerpc powerpc64le s390x sparc64; do
        case $2 in c++*) language=c++ ;; *) language=c ;; esac
        "$1" "--target=$target" -x "$language" "-std=$2" "-ffp-contract=$3" -O1 $warnings \
            -S -emit-llvm "$sources" -o "$sources.ll" || return 1
        awk -v mode="$3" -v target="$target" '
            /^define/ { name = $0 ~ /before/ ? "before" : $0 ~ /inside/ ? "inside" : "after" }
            /^declare/ { name = "" }
            / fmul | fadd |fmuladd/ {
                gsub(/%[^ ,)]*|[ ,=]+/, " ")
                body[name] = body[name] $0
            }
            END {
                fused["on"] = "fmuladd"
                fused["fast"] = "contract"
                fused["off"] = "fmul double"
                print target, mode, "before", body["before"], "inside", body["inside"]
                if (body["before"] != body["after"]) print "after:", body["after"]
                exit !(body["before"] == body["after"] && body["before"] ~ fused[mode] &&
                       body["inside"] ~ / fmul double/ && body["inside"] ~ / fadd double/)
            }' "$sources.ll" || return 1
    done
}

# The first or second block of the header that sets contraction: from `#if` to `#endif`.
pragma_lines() {
    awk -v wanted="$1" '
        /^#if defined\(__clang__\)$/ { block = ""; on = 1 }
        on { block = block $0 "\n" }
        on && /^#endif/ { on = 0; if (block ~ /FP_CONTRACT|float_control/ && ++n == wanted) printf "%s", block }
    ' ../dem2d.h
}

# Names that a linker sees begin with dem2d_.
exports() {
    command -v nm > /dev/null || return 0
    strange=$(nm -g "$1" | awk '$2 ~ /^[A-TV-Z]$/ && $3 !~ /^_?dem2d_/ { print $3 }')
    if [ -n "$strange" ]; then
        echo "exported: $strange"
        return 1
    fi
}

# --- the list of combinations ------------------------------------------------------------------

probe() {
    echo 'int main(void) { return 0; }' > "$out/probe.$3"
    "$1" "-std=$2" -c "$out/probe.$3" -o "$out/probe.o" 2> "$out/probe.log"
}

list=$out/list
: > "$list"
for compiler in gcc clang g++ clang++; do
    case $compiler in
    *++) standards='c++11 c++17 c++20' end=cpp ;;
    *) standards='c99 c11 c2x' end=c ;;
    esac
    if ! command -v "$compiler" > /dev/null; then
        echo "skip  $compiler is not installed"
        continue
    fi
    for standard in $standards; do
        if ! probe "$compiler" "$standard" "$end"; then
            echo "skip  $compiler does not take -std=$standard"
            continue
        fi
        case ${LONG:+long-}$compiler-$standard in
        long-* | gcc-c99 | g++-c++11) levels='-O0 -O2' ;;
        clang-c99 | clang++-c++11) levels=-O0 ;;
        *) levels= ;;
        esac
        for level in $levels; do
            echo "two-files $compiler $standard $level" >> "$list"
        done
        [ -n "$levels" ] || echo "parse $compiler $standard -fsyntax-only" >> "$list"
        case $standard in
        c99 | c++11)
            for kind in one-file static; do
                echo "$kind $compiler $standard -O0" >> "$list"
            done
            [ "$compiler" != gcc ] && [ -z "${LONG:-}" ] ||
                echo "static $compiler $standard -O2" >> "$list"
            for part in fast-math finite-math-only; do
                echo "fast-math $compiler $standard -f$part" >> "$list"
            done
            case $compiler in
            clang*)
                for mode in on off fast; do
                    echo "contraction $compiler $standard $mode" >> "$list"
                done
                ;;
            g*) # only gcc tells of these
                for part in unsafe-math-optimizations reciprocal-math; do
                    echo "fast-math $compiler $standard -f$part" >> "$list"
                done
                ;;
            esac
            [ "$compiler$standard" = g++c++11 ] && command -v gcc > /dev/null &&
                echo "mixed g++ c++11 -O0" >> "$list"
            [ "$compiler$standard" = gccc99 ] && [ -s "$out/readme.c" ] &&
                echo "readme $compiler c99 -O0" >> "$list"
            ;;
        esac
    done
done

mingw=x86_64-w64-mingw32-gcc
if command -v "$mingw" > /dev/null; then
    echo "windows $mingw c99 -O0" >> "$list"
else
    echo "skip  $mingw is not installed"
fi

# --- workers: each takes the next line that no other has taken ----------------------------------

jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN 2> /dev/null || echo 2)}
[ "$jobs" -le 4 ] 2> /dev/null || jobs=4

worker() {
    while read -r k c s l; do
        log=$out/$(echo "$k.$c.$s.$l" | tr '+' 'p').log
        mkdir "${log%.log}.taken" 2> /dev/null || continue
        if (combination "$k" "$c" "$s" "$l") > "$log" 2>&1; then
            echo "ok    $c -std=$s $l $k"
        else
            echo "FAIL  $c -std=$s $l $k"
            echo "$log" >> "$out/failed.$1"
        fi
    done < "$list"
}

i=0
while [ "$i" -lt "$jobs" ]; do
    worker "$i" &
    i=$((i + 1))
done
wait

total=$(wc -l < "$list")
failed=$(cat "$out"/failed.* 2> /dev/null)
if [ -n "$failed" ]; then
    for log in $failed; do
        echo "--- $log"
        head -n 20 "$log"
    done
    echo "compile matrix: FAILED, $(echo "$failed" | wc -l) of $total"
    exit 1
fi
[ "$total" -gt 0 ] || { echo 'compile matrix: no compiler found'; exit 1; }
echo "compile matrix: all $total combinations"
