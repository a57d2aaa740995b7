# The pictures of the README, from the files that `make pictures` has put beside each other: a
# photograph and the templates of its grains, and the resistance of a packing of them.
set terminal pngcairo size 320,240 font 'sans,9'
set palette gray
set datafile separator ','
unset key; unset colorbox; unset tics; unset border
set margins 0, 0, 0, 0
set xrange [0:480]; set yrange [0:360]; set cbrange [0:255]
picture = "< tail -n +2 photograph.pgm | awk '{ print (NR - 1) % 480 + 0.5 \",\" 359.5 - int((NR - 1) / 480) \",\" $1 }'"
set output 'photograph.png'
plot picture using 1:2:3 with image
set output 'templates.png'
plot for [i = 1:12] sprintf('fit_%02d.csv', i) using 1:2 with filledcurves closed \
         fillcolor rgb '#8fb9d8', \
     for [i = 1:12] sprintf('fit_%02d.csv', i) using 1:2 with lines linewidth 2 \
         linecolor rgb '#1050c0'
reset
set datafile separator ','
set terminal pngcairo size 320,240 font 'sans,9'
set output 'resistance.png'
set xlabel 'axial strain, %'; set ylabel 'q/p'; set grid; unset key
set xrange [0:*]; set yrange [0:*]
plot 'history.csv' using (100 * column('axial_strain')):(column('stage') == 2 ? column('stress_ratio') : NaN) \
     with lines linewidth 2 linecolor rgb '#7a0019'
