# Compares the measured figures (second file, "ROW | FIGURE") with the expected ones (first file,
# "KEY | ROW | FIGURE | COMMENT") of `key`. With `renew`, writes build/bench_guard.txt: the table with
# the measured figures. A row that rises gets `why` as its comment there, and needs one. Exit status:
# 0, or 1 when a row rose by more than LIMIT percent (and, with renew, `why` is empty).

BEGIN {
    FS = " *[|] *"
    LIMIT = 3
}

FNR == NR {
    line[++lines] = $0
    if ($0 ~ /^#/ || NF < 3) next
    if ($1 == key) {
        known = 1
        expected[$2] = $3
        comment[$2] = $4
    } else {
        other[lines] = 1
    }
    next
}

function verdict(row, got,    change) {
    if (!(row in expected)) return renew ? "new" : "no expected figure: RENEW=1 writes it"
    change = 100 * (got / expected[row] - 1)
    if (change > LIMIT) {
        rose++
        comment[row] = why
        return sprintf("%+.1f %%  ROSE", change)
    }
    if (change < -LIMIT) {
        comment[row] = ""
        return sprintf("%+.1f %%  fell: RENEW=1 makes the table follow", change)
    }
    return sprintf("%+.1f %%", change)
}

{
    if (++rows == 1) {
        if (!known && !renew) {
            print "skipped: bench_guard.txt has no figures of " key " (RENEW=1 writes them)"
            exit
        }
        printf "%-28s %10s %10s   %s\n", key, "expected", "measured", "change"
    }
    printf "%-28s %10s %10s   %s\n", $1, ($1 in expected) ? expected[$1] : "-", $2, verdict($1, $2)
    measured[rows] = sprintf("%-20s | %-24s | %8s | %s", key, $1, $2, comment[$1])
}

END {
    if (rose > 0) printf "%d rows rose by more than %d %%\n", rose, LIMIT
    if (rose > 0 && !renew) {
        print "If the rise is meant, write down why: make bench-guard RENEW=1 WHY='reason'"
        exit 1
    }
    if (rose > 0 && why == "") {
        print "WHY is empty: nothing was written"
        exit 1
    }
    if (!renew) exit 0
    for (i = 1; i <= lines; i++)
        if (line[i] ~ /^#/ || i in other) print line[i] > "build/bench_guard.txt"
    for (i = 1; i <= rows; i++) {
        sub(/ +$/, "", measured[i])
        print measured[i] > "build/bench_guard.txt"
    }
}
