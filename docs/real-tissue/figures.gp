# gnuplot figures.gp: the pictures of docs/real-tissue.md, from the figures in its tables.
set terminal svg size 760,300 font "sans,12" background "white"
set grid ytics lc rgb "#dddddd"
set border 3
set tics nomirror

set output "held-out.svg"
set ylabel "held-out RMSE, mm"
set yrange [0:1.4]
set xrange [0.3:16]
set key top right
set xtics ("ex vivo" 2, "phantom A" 6, "phantom B" 10, "phantom C" 14)
$held << EOD
1 0.85 0.48
2 0.57 0.43
3 0.55 0.46
5 1.26 0.62
6 0.96 0.62
7 0.93 0.42
9 0.93 0.48
10 0.71 0.36
11 0.31 0.52
13 0.52 0.37
14 0.62 0.46
15 1.10 0.55
EOD
plot $held using 1:2:(0):($3-$2) with vectors nohead lc rgb "#999999" notitle, \
     $held using 1:2 with points pt 7 ps 1 lc rgb "#c0392b" title "bicycle", \
     $held using 1:3 with points pt 7 ps 1 lc rgb "#2471a3" title "with what was found"

set output "entry-tilt.svg"
set key outside right
set ylabel "entry tilt fitted alone, rad"
set yrange [-0.03:0.08]
set xtics ("ex vivo" 1, "A" 2, "B" 3, "C" 4)
set xrange [0.5:4.5]
set arrow 1 from 0.5,0 to 4.5,0 nohead lc rgb "#666666"
$tilt << EOD
1 0.0650 0.0183 0.0652 0.0178 0.0653 0.0185
2 0.0450 -0.0132 0.0450 -0.0132 0.0456 -0.0135
3 0.0457 -0.0045 0.0431 -0.0037 0.0427 -0.0036
4 0.0619 -0.0070 0.0598 -0.0069 0.0597 -0.0068
EOD
plot $tilt using ($1-0.12):2 with points pt 7 lc rgb "#c0392b" title "toward the bend, 2 s a step", \
     $tilt using 1:4 with points pt 9 lc rgb "#c0392b" title "0.5 s a step", \
     $tilt using ($1+0.12):6 with points pt 5 lc rgb "#c0392b" title "the hand's times", \
     $tilt using ($1-0.12):3 with points pt 6 lc rgb "#2471a3" title "across, 2 s a step", \
     $tilt using 1:5 with points pt 8 lc rgb "#2471a3" title "0.5 s a step", \
     $tilt using ($1+0.12):7 with points pt 4 lc rgb "#2471a3" title "the hand's times"
unset arrow 1

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
