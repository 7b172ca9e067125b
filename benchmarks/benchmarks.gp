# Draws the benchmarks' figures from the .dat files that report.py wrote: benchmarks_sizes, _roof and
# _orders, each as svg and png. Set before: results, the folder of both.

set encoding utf8
sizes = results."/benchmarks_sizes.dat"
roof = results."/benchmarks_roof.dat"
orders = results."/benchmarks_orders.dat"

colours = "#0072b2 #d55e00 #009e73 #aa3377 #777777 #000000"
ops = "search weights spmv"
op_names = "'neighbour search' 'weights (mixed-soc)' 'product'"
rivals = "eigen gradpsi gradpsi-single gradpsi-symmetric gradpsi-4rhs sell"

# What the legend's strip, the last panel of each figure, takes away.
axes = "set border 31 lw 0.8; set xtics mirror auto; set ytics mirror auto; set tics scale 0.6; \
  set grid xtics ytics lc rgb '#e4e4e4' lw 0.6 dt 1; set key off; unset logscale"
start(name, width, height) = format eq "svg" ? \
  sprintf("set terminal svg size %d, %d enhanced font 'DejaVu Sans,13' background 'white'; \
    set output '%s/%s.svg'", width, height, results, name) : \
  sprintf("set terminal pngcairo size %d, %d enhanced font 'DejaVu Sans,11' background 'white'; \
    set output '%s/%s.png'", width, height, results, name)

do for [format in "svg png"] {
  # Cost of a point against the number of points.
  eval start("benchmarks_sizes", 1000, 400)
  eval axes
  set multiplot
  set logscale xy
  set format x "10^{%L}"
  set autoscale xy  # ranges set before would hide points from stats
  stats sizes using 5 name "S" nooutput
  set xrange [600:8e6]
  set yrange [S_min / 1.6 : S_max * 1.6]
  set tmargin at screen 0.9; set bmargin at screen 0.27
  do for [dim = 1:3] {
    set lmargin at screen 0.08 + 0.31 * (dim - 1); set rmargin at screen 0.08 + 0.31 * dim - 0.025
    set title sprintf("%dD", dim)
    set xlabel "points"
    set ylabel (dim == 1 ? "ns a point" : "")
    set format y (dim == 1 ? "%g" : "")
    plot for [o = 1:3] for [t = 1:2] sizes using 3:(strcol(1) eq word(ops, o) && $2 == dim && $4 == t \
      ? $5 : NaN) with linespoints lw 1.8 dt 2*t-1 pt 8-t ps 0.7 \
      lc rgb word(colours, o)
  }
  # The legend fills the strip below the panels.
  unset logscale; unset title; unset xlabel; unset ylabel; unset border; unset tics; unset grid
  set lmargin at screen 0; set rmargin at screen 1; set bmargin at screen 0; set tmargin at screen 0.1
  set xrange [1:2]; set yrange [1:2]
  set key center center horizontal maxrows 1 width 2 samplen 3
  plot for [o = 1:3] NaN with lines lw 3 lc rgb word(colours, o) title word(op_names, o), \
    NaN with linespoints lw 1.8 pt 7 ps 0.7 lc rgb "black" title "one thread", \
    NaN with linespoints lw 1.8 dt 3 pt 6 ps 0.7 lc rgb "black" title "two threads"
  unset multiplot
  unset output

  # How much of the memory's speed each product has.
  eval start("benchmarks_roof", 1000, 420)
  eval axes
  set multiplot
  set autoscale xy
  stats roof using 1 name "R" nooutput
  stats roof using 5 name "P" nooutput
  set xrange [0 : (P_max > 100 ? P_max * 1.05 : 105)]
  set yrange [0.5 : R_max + 0.5]
  set arrow 1 from 100, graph 0 to 100, graph 1 nohead lw 1.2 dt 5 lc rgb "black"
  set tmargin at screen 0.9; set bmargin at screen 0.25
  set format x "%g"
  do for [dim = 2:3] {
    set lmargin at screen 0.19 + 0.4 * (dim - 2); set rmargin at screen 0.19 + 0.4 * (dim - 1) - 0.02
    set title sprintf("%dD", dim)
    set xlabel "% of the bandwidth of reading"
    set ytics 1 nomirror scale 0
    set format y ""
    point = "using ($3 == dim && $4 == t ? $5 : NaN):1".(dim == 2 ? ":ytic(2) " : " ")
    style = "with points pt 8-t ps 1.4 lw 1.8 lc rgb word(colours, 1)"
    eval "plot for [t = 1:2] roof ".point.style
  }
  unset arrow 1; unset title; unset xlabel; unset border; unset tics; unset grid
  set lmargin at screen 0; set rmargin at screen 1; set bmargin at screen 0; set tmargin at screen 0.1
  set xrange [1:2]; set yrange [1:2]
  set key center center horizontal maxrows 1 width 2 samplen 3
  plot NaN with points pt 7 ps 1.4 lc rgb word(colours, 1) title "one thread", \
    NaN with points pt 6 ps 1.4 lw 1.8 lc rgb word(colours, 1) title "two, of the bandwidth of two", \
    NaN with lines lw 1.2 dt 5 lc rgb "black" title "reading an array"
  unset multiplot
  unset output

  # What the order of the points costs.
  eval start("benchmarks_orders", 1000, 440)
  eval axes
  set multiplot
  set autoscale xy
  stats orders using ($5 == 1 ? $6 : NaN) name "O" nooutput
  set xrange [0.6 : 4.4]
  set yrange [O_min / 1.3 : O_max * 1.3]
  set logscale y
  set ytics mirror (0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 4, 5, 7, 10)
  set tmargin at screen 0.9; set bmargin at screen 0.27
  do for [dim = 2:3] {
    set lmargin at screen 0.08 + 0.46 * (dim - 2); set rmargin at screen 0.08 + 0.46 * (dim - 1) - 0.03
    set title sprintf("%dD, one thread", dim)
    set xlabel "order of the points (RCM: reverse Cuthill-McKee)"
    set xtics ("tree" 1, "lattice" 2, "RCM" 3, "random" 4)
    set ylabel (dim == 2 ? "ns an entry" : "")
    set format y (dim == 2 ? "%g" : "")
    plot for [i = 1:words(rivals)] orders using \
      1:(strcol(3) eq word(rivals, i) && $4 == dim && $5 == 1 ? $6 : NaN) \
      with linespoints lw 1.8 pt 7 ps 0.9 lc rgb word(colours, i)
  }
  unset logscale; unset title; unset xlabel; unset ylabel; unset border; unset tics; unset grid
  set lmargin at screen 0; set rmargin at screen 1; set bmargin at screen 0; set tmargin at screen 0.1
  set xrange [1:2]; set yrange [1:2]
  set key center center horizontal maxrows 1 width 1 samplen 2
  plot for [i = 1:words(rivals)] NaN with linespoints lw 1.8 pt 7 ps 0.9 lc rgb word(colours, i) \
    title word(rivals, i)
  unset multiplot
  unset output
}
