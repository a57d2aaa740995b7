# figures.gp - draws what biaxial and figures have written into the folder it is started in: see
# make -C examples figures.

set datafile separator comma
set terminal svg size 520,420 font "sans-serif,15" background "white"
set grid linecolor "#d8d8d8"
set border linecolor "#444444"
unset key

array names[3] = ["noncircular", "circular", "irregular"]
array colours[3] = ["#1f5fbf", "#c8382c", "#3d8f4f"]

# ---- shapes: thin lines are the grains, thick ones their mean ----

set key bottom right reverse Left samplen 2
set output "p08_accuracy.svg"
set xlabel "segments"
set ylabel "accuracy, %"
set xrange [3:10]
set yrange [*:100]
plot "fits_polygon.csv" using 1:2 with lines linecolor "#f0c4bf" notitle, \
     "fits_bezier.csv" using 1:2 with lines linecolor "#c0d4ee" notitle, \
     "accuracy.csv" using "count":"polygon" with linespoints linewidth 2 pointtype 6 \
         linecolor "#c8382c" title "polygon", \
     "" using "count":"bezier" with linespoints linewidth 2 pointtype 7 linecolor "#1f5fbf" \
         title "polybezier"

set output "f05_coverage.svg"
set xlabel "order"
set ylabel "coverage, %"
set xrange [1:16]
plot "fits_radial.csv" using 1:2 with lines linecolor "#d8d8d8" notitle, \
     "fits_reduced.csv" using 1:2 with lines linecolor "#f0c4bf" notitle, \
     "fits_constrained.csv" using 1:2 with lines linecolor "#c0d4ee" notitle, \
     "coverage.csv" using "count":"radial" with linespoints linewidth 2 pointtype 4 \
         linecolor "#666666" title "original FS (radius)", \
     "" using "count":"reduced" with linespoints linewidth 2 pointtype 6 linecolor "#c8382c" \
         title "new FS, reduction", \
     "" using "count":"constrained" with linespoints linewidth 2 pointtype 7 \
         linecolor "#1f5fbf" title "new FS, constrained fit"

# ---- packing: full lines local, dashed ones global damping ----

set key outside center top horizontal reverse Left samplen 1.5 width -3 maxrows 1
set xlabel "time, s"
set xrange [*:*]
set yrange [*:*]
set logscale y
set title "full: local damping, dashed: global damping" font ",15"
set format y "10^{%L}"
set output "p11_speed.svg"
set ylabel "mean speed, m/s"
plot for [i=1:3] names[i]."_local/history.csv" using (column("stage") == 0 ? column("time") : NaN):"mean_speed" \
         with lines linecolor rgb colours[i] title names[i], \
     for [i=1:3] names[i]."_global/history.csv" using (column("stage") == 0 ? column("time") : NaN):"mean_speed" \
         with lines dashtype 2 linecolor rgb colours[i] notitle
set output "p11_kinetic.svg"
set ylabel "kinetic energy / energy in contacts"
plot for [i=1:3] names[i]."_local/history.csv" using (column("stage") == 0 ? column("time") : NaN):"kinetic_ratio" \
         with lines linecolor rgb colours[i] title names[i], \
     for [i=1:3] names[i]."_global/history.csv" using (column("stage") == 0 ? column("time") : NaN):"kinetic_ratio" \
         with lines dashtype 2 linecolor rgb colours[i] notitle
unset logscale y
set format y
unset title

# ---- energy: full lines noncircular, dashed ones circular grains, local damping ----

set output "energy.svg"
set key width 1
set ylabel "energy, kJ/m"
set title "full: noncircular, dashed: circular (local damping)" font ",15"
array runs[2] = ["noncircular_local/history.csv", "circular_local/history.csv"]
array dashes[2] = [1, 2]
kilo(name) = column("ledger_".name) / 1000
plot for [i=1:2] runs[i] using "time":(kilo("gravity") + kilo("walls") + kilo("given")) with lines \
         linewidth 2 dashtype dashes[i] linecolor "#222222" title i == 1 ? "put in" : "", \
     for [i=1:2] runs[i] using "time":(kilo("damping")) with lines dashtype dashes[i] \
         linecolor "#1f5fbf" title i == 1 ? "damping" : "", \
     for [i=1:2] runs[i] using "time":(kilo("friction")) with lines dashtype dashes[i] \
         linecolor "#c8382c" title i == 1 ? "friction" : "", \
     for [i=1:2] runs[i] using "time":(kilo("kinetic") + kilo("normal") + kilo("tangential")) \
         with lines dashtype dashes[i] linecolor "#3a8f4d" title i == 1 ? "stored" : ""
set key width -3
unset title

# ---- histograms ----

set style fill solid 0.8 noborder
set style histogram clustered gap 1
set style data histograms
set boxwidth 0.9
set yrange [0:*]
set xrange [*:*]
set output "p13_coordination.svg"
set xlabel "contacts of a grain"
set ylabel "grains, %"
plot for [i=1:3] "coordination.csv" using names[i]:xtic(1) linecolor rgb colours[i] title names[i]

set xlabel "support calls of GJK"
set ylabel "pairs, %"
array calls[4] = ["noncircular", "fs", "polygon", "bezier"]
array outputs[4] = ["p14_calls", "f08_calls_fs", "f08_calls_polygon", "f08_calls_bezier"]
array texts[4] = ["noncircular grains", "FS and FS", "polygon and polygon", \
                  "polybezier and polybezier"]
set yrange [0:100]
do for [i=1:4] {
    set output outputs[i].".svg"
    set title texts[i] font ",15"
    plot "calls_".calls[i].".csv" using "none":xtic(1) linecolor rgb "#999999" title "apart", \
         "" using "contact" linecolor rgb "#1f5fbf" title "in contact"
}

# ---- EPA: every pair in contact, and the median ----

set style data lines
set logscale y
set format y "10^{%L}"
set xlabel "iterations of EPA"
set ylabel "residual / size of the pair"
set xrange [0:30]
set yrange [1e-17:1]
array models[3] = ["bezier", "fs", "polygon"]
array epas[3] = ["p15_epa_bezier", "f08_epa_fs", "f08_epa_polygon"]
array pairs[3] = ["polybezier and polybezier", "FS and FS", "polygon and polygon"]
do for [i=1:3] {
    set output epas[i].".svg"
    set title pairs[i] font ",15"
    plot "epa_".models[i].".csv" using 1:2 with lines linecolor "#b9cce6" title "a pair", \
         "epa_".models[i]."_median.csv" using 1:2 with lines linewidth 3 linecolor "#1f5fbf" \
             title "median", \
         1e-2 * 4.0**(-x) with lines dashtype 2 linewidth 2 linecolor "#c8382c" \
             title "1/4 per iteration"
}
unset title
unset logscale y
set format y

# ---- biaxial compression ----

set xrange [0:*]
set yrange [0:*]
set xlabel "axial strain, %"
set title "full: local damping, dashed: global damping" font ",15"
set output "p17_ratio.svg"
set ylabel "stress ratio q/p"
plot for [i=1:3] names[i]."_local/history.csv" \
         using (100 * column("axial_strain")):(column("stage") == 2 ? column("stress_ratio") : NaN) \
         with lines linecolor rgb colours[i] title names[i], \
     for [i=1:3] names[i]."_global/history.csv" \
         using (100 * column("axial_strain")):(column("stage") == 2 ? column("stress_ratio") : NaN) \
         with lines dashtype 2 linecolor rgb colours[i] notitle
set yrange [*:*]
set output "p17_volume.svg"
set ylabel "volumetric strain (compression > 0), %"
plot for [i=1:3] names[i]."_local/history.csv" \
         using (100 * column("axial_strain")):(column("stage") == 2 ? 100 * column("volumetric_strain") : NaN) \
         with lines linecolor rgb colours[i] title names[i], \
     for [i=1:3] names[i]."_global/history.csv" \
         using (100 * column("axial_strain")):(column("stage") == 2 ? 100 * column("volumetric_strain") : NaN) \
         with lines dashtype 2 linecolor rgb colours[i] notitle

# Beside them the runs in the papers' mode, where there are any.
array folders[2] = ["noncircular_local", "irregular_global"]
array modes[2] = ["papers_p", "papers_f"]
array pages[2] = ["p17_papers", "f07_papers"]
array scenes[2] = ["noncircular, local damping", "all models, global damping"]
if (system("test -e papers_p/history.csv -a -e papers_f/history.csv && echo 1") eq "1") {
    set key maxrows 2
    do for [k=1:2] {
        set output pages[k].".svg"
        set title scenes[k] font ",15"
        set ylabel "q/p; volumetric strain / 10 %"
        plot folders[k]."/history.csv" using (100 * column("axial_strain")):(column("stage") == 2 ? column("stress_ratio") : NaN) \
                 with lines linecolor "#1f5fbf" title "q/p, default", \
             modes[k]."/history.csv" using (100 * column("axial_strain")):(column("stage") == 2 ? column("stress_ratio") : NaN) \
                 with lines linecolor "#c8382c" title "q/p, papers' mode", \
             folders[k]."/history.csv" using (100 * column("axial_strain")):(column("stage") == 2 ? 10 * column("volumetric_strain") : NaN) \
                 with lines dashtype 2 linecolor "#1f5fbf" title "volume, default", \
             modes[k]."/history.csv" using (100 * column("axial_strain")):(column("stage") == 2 ? 10 * column("volumetric_strain") : NaN) \
                 with lines dashtype 2 linecolor "#c8382c" title "volume, papers' mode"
    }
    set key maxrows 1
}

set title "full: axial, dashed: lateral" font ",15"
set yrange [0:*]
set xrange [*:*]
set output "f07_stress.svg"
set xlabel "time, s"
set ylabel "stress, kPa"
set arrow 1 from graph 0, first 100 to graph 1, first 100 nohead dashtype 3 linecolor "#444444"
plot for [i=1:3] names[i]."_local/history.csv" \
         using (column("stage") > 0 ? column("time") : NaN):(column("axial_stress") / 1000) \
         with lines linecolor rgb colours[i] title names[i], \
     for [i=1:3] names[i]."_local/history.csv" \
         using (column("stage") > 0 ? column("time") : NaN):(column("lateral_stress") / 1000) \
         with lines dashtype 2 linecolor rgb colours[i] notitle
unset arrow 1
unset title

# ---- polar diagrams ----

# Greatest radii first: stats does not work in polar mode.
array polars[5] = ["alignment", "polar_normals", "polar_branches", "polar_forces", "polar_shear"]
array roses[5] = ["p12_alignment", "p18_normals", "p18_branches", "p18_forces", "p18_shear"]
array heads[5] = ["long axes, % in 10 degrees", "contact normals, % in 10 degrees", \
                  "contact branches, % in 10 degrees", "mean normal force, kN/m", \
                  "mean shear force, kN/m"]
array others[5] = ["irregular", "circular", "circular", "circular", "circular"]
array reach[5]
array step[5]
do for [k=1:5] {
    stats polars[k].".csv" using "noncircular" name "A" nooutput
    stats polars[k].".csv" using others[k] name "B" nooutput
    top = A_max > B_max ? A_max : B_max
    ten = 10.0**floor(log10(top))
    step[k] = top / ten < 2 ? ten / 2 : top / ten < 5 ? ten : 2 * ten
    reach[k] = step[k] * ceil(top / step[k])
}
set terminal svg size 460,500 font "sans-serif,15" background "white"
set polar
set angles degrees
set size square
unset border
unset xtics
unset ytics
unset xlabel
unset ylabel
set grid polar 30 linecolor "#c8c8c8"
set ttics 0, 30 format "%g" font ",13"
set style fill transparent solid 0.35 border
set key outside center bottom horizontal noreverse Right samplen 2 width 0 maxrows auto
set lmargin 4
set rmargin 4
do for [k=1:5] {
    set output roses[k].".svg"
    set title heads[k] font ",15"
    set rrange [0:reach[k]]
    set rtics step[k] font ",12"
    set xrange [-reach[k]:reach[k]]
    set yrange [-reach[k]:reach[k]]
    plot polars[k].".csv" using "angle":"noncircular" with filledcurves \
             linecolor rgb colours[1] title "noncircular", \
         "" using "angle":others[k] with filledcurves \
             linecolor rgb (k == 1 ? colours[3] : colours[2]) title others[k]
}
set output
