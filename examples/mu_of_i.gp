# Draws mu_of_i.csv: gnuplot mu_of_i.gp, in the folder of the file. Bars are standard errors.
set datafile separator comma
set terminal svg size 820,400 font "sans-serif,14" background "white"
set output "mu_of_i.svg"
set multiplot layout 1,2
set grid linecolor "#d8d8d8"
set border linecolor "#444444"
set key left Left reverse samplen 1
set logscale x
set xrange [7e-3:0.14]
set xtics (0.01, 0.03, 0.1)
set xlabel "inertial number I"
array names[2] = ["discs", "grains"]
array colours[2] = ["#1f5fbf", "#c8382c"]
set ylabel "friction"
plot for [i=1:2] "mu_of_i.csv" using (strcol(1) eq names[i] ? $2 : NaN):3:4 with yerrorlines \
         pointtype 5 + i linecolor rgb colours[i] title names[i]
set ylabel "solid fraction"
set key bottom
plot for [i=1:2] "mu_of_i.csv" using (strcol(1) eq names[i] ? $2 : NaN):5:6 with yerrorlines \
         pointtype 5 + i linecolor rgb colours[i] title names[i]
unset multiplot
