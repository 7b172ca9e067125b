# Draws what cavity computes beside what is published:
#     build/release/apps/cavity > cavity.csv && gnuplot apps/examples/flows/cavity.gp     (writes cavity.png)

set datafile separator ","
set terminal pngcairo size 1000, 460 enhanced font "DejaVu Sans,11" background "white"
set output "cavity.png"
set border lw 0.8
set tics scale 0.6
set grid lc "#dddddd" lt 1
set xrange [0:1]
set multiplot layout 1, 2 title "Cavity with a moving lid, Re 100: velocities on its centre lines"
set key left top reverse Left

set xlabel "y, on x = 1/2"
set ylabel "u_x / lid's velocity"
plot "cavity.csv" using (strcol(1) eq "u_x" ? $2 : NaN):3 with lines lw 2 lc "#0072b2" title "gradpsi", \
     "" using (strcol(1) eq "u_x" ? $2 : NaN):4 with points pt 6 lc "black" title "Ghia, Ghia, Shin (1982)"

set key right top
set xlabel "x, on y = 1/2"
set ylabel "u_y / lid's velocity"
set yrange [-0.3:0.3]
plot "cavity.csv" using (strcol(1) eq "u_y" ? $2 : NaN):3 with lines lw 2 lc "#0072b2" title "gradpsi", \
     "" using (strcol(1) eq "u_y" ? $2 : NaN):4 with points pt 6 lc "black" title "Ghia, Ghia, Shin (1982)"
unset multiplot
