# Draws incline.csv: gnuplot incline.gp, in the folder of the file.
set datafile separator comma
set terminal svg size 820,400 font "sans-serif,14" background "white"
set output "incline_profiles.svg"
set multiplot layout 1,2
set grid linecolor "#d8d8d8"
set border linecolor "#444444"
set key right bottom Left reverse samplen 1
set ylabel "depth, diameters"
set yrange [0:*] reverse
array angles[2] = [24, 21]
array colours[2] = ["#c8382c", "#1f5fbf"]
set xlabel "speed, sqrt(g d)"
set xrange [0:*]
plot for [i=1:2] "incline.csv" using ($1 == angles[i] ? $3 : NaN):2 with points \
         pointtype 5 + i linecolor rgb colours[i] title sprintf("%g degrees", angles[i]), \
     for [i=1:2] "incline.csv" using ($1 == angles[i] ? $4 : NaN):2 with lines \
         linecolor rgb colours[i] notitle
set xlabel "inertial number I"
plot for [i=1:2] "incline.csv" using ($1 == angles[i] ? $5 : NaN):2 with linespoints \
         pointtype 5 + i linecolor rgb colours[i] notitle
unset multiplot
