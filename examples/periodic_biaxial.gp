# Resistance and volume in two biaxial tests of the same grains, with walls and in a periodic cell,
# from the files that `make periodic` has put beside each other.
set datafile separator ','
set terminal pngcairo size 900,400 font 'sans,10'
set output 'periodic_biaxial.png'
set grid; set key bottom right; set xlabel 'axial strain, %'; set xrange [0:*]
walls = 'history.csv'; cell = 'periodic.csv'
pressed(x) = column('stage') == 2 ? x : NaN
set multiplot layout 1,2
set ylabel 'q/p'; set yrange [0:*]
plot walls using (100 * column('axial_strain')):(pressed(column('stress_ratio'))) with lines \
         linecolor rgb '#999999' title 'four walls', \
     cell using (100 * column('axial_strain')):(pressed(column('stress_ratio'))) with lines \
         linewidth 2 linecolor rgb '#7a0019' title 'periodic cell'
set ylabel 'volumetric strain (compression positive), %'; set yrange [*:*]; set key bottom right
plot walls using (100 * column('axial_strain')):(pressed(100 * column('volumetric_strain'))) \
         with lines linecolor rgb '#999999' title 'four walls', \
     cell using (100 * column('axial_strain')):(pressed(100 * column('volumetric_strain'))) \
         with lines linewidth 2 linecolor rgb '#7a0019' title 'periodic cell'
unset multiplot
