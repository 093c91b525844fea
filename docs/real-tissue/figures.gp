# gnuplot figures.gp (Debian: gnuplot-nox): the pictures of docs/real-tissue.md, from the figures in its tables.
set terminal svg size 760,300 font "sans,12" background "white"
set grid ytics lc rgb "#dddddd"
set border 3
set tics nomirror

set output "lara.svg"
set multiplot layout 1,2
set xlabel "share of the step without turning"
set ylabel "motion off the tip's axis, rad"
set xrange [-0.05:1]
set yrange [0:0.07]
set xtics 0.25
set key inside top left
$lara << EOD
0.75 0.0470 0.0035 0.875
0.50 0.0292 0.0043 0.845
0.62 0.0300 0.0037 0.862
0.81 0.0371 0.0029 0.877
0.88 0.0363 0.0039 0.902
0.75 0.0327 0.0032 0.908
0.25 0.0200 0.0076 0.862
0.00 0.0156 0.0074 0.867
0.75 0.0313 0.0038 0.933
0.25 0.0206 0.0080 0.919
EOD
plot $lara using 1:2:3 with yerrorbars pt 7 lc rgb "#c0392b" title "toward the bend", \
     0.0145 + 0.0279 * x lc rgb "#999999" title "0.0145 + 0.0279 share"
set ylabel "advance / commanded"
set yrange [0.7:1.05]
set arrow 1 from -0.05,1 to 1,1 nohead lc rgb "#666666"
plot $lara using 1:4 with points pt 7 lc rgb "#2471a3" notitle
unset multiplot
