# Draws the errors of all schemes from their CSV: a line for each scheme, from the coarser points (hollow) to the
# finer ones (filled), inside and at the wall; a panel for each support, the smallest error inside on top.
# Set before: csv, suffix ("" or, for example, "_3d").

set datafile separator ","
set encoding utf8
set logscale x
set format x "10^{%L}"
set border lw 0.8
set tics scale 0.6
unset key

colours = "#0072b2 #d55e00"
ratios = "2.5 3.5"
# Columns of the errors of the finer and of the coarser points, inside and at the wall.
fine = "6 7"
coarse = "9 10"

shown(kind, p, value) = \
  strstrt(strcol(1), kind) == 1 && abs($2 - word(ratios, p)) < 1e-9 ? value : NaN
error(kind, p, columns, k) = shown(kind, p, column(word(columns, k) + 0))
# Inside and wall a little apart, so that neither hides the other.
height(kind, p, k) = -$13 + 0.17 * (3 - 2 * k)
after_dash(name) = name[strstrt(name, "-") + 1 : strlen(name)]

do for [format in "svg png"] {
  do for [kind in "gradient laplacian"] {
    set autoscale xy
    most = 0; least_x = 1e300; most_x = 0
    do for [p = 1:2] {
      stats csv skip 1 using (shown(kind, p, $13)) name "S" nooutput
      most = S_max > most ? S_max : most
      do for [k = 1:2] {
        stats csv skip 1 using (error(kind, p, fine, k)) name "S" nooutput
        least_x = S_min < least_x ? S_min : least_x
        most_x = S_max > most_x ? S_max : most_x
      }
    }
    pixels = 21 * most + 140
    if (format eq "svg") {
      set terminal svg size 1100, pixels enhanced font "DejaVu Sans,12" background "white"
    } else {
      set terminal pngcairo size 1100, pixels enhanced font "DejaVu Sans,10" background "white"
    }
    set output sprintf("cited_%s%s.%s", kind, suffix, format)
    set multiplot
    do for [p = 1:2] {
      set lmargin at screen 0.5 * (p - 1) + 0.115; set rmargin at screen 0.5 * p - 0.015
      set tmargin at screen 1 - 40.0 / pixels; set bmargin at screen 95.0 / pixels
      set border; set xtics; unset ytics
      set grid x lc rgb "#e4e4e4" lw 0.6 dt 1
      set title kind.", h/dx = ".word(ratios, p)
      set xlabel "L2 error"
      set xrange [least_x / 3 : most_x * 3]
      set yrange [-most - 0.7 : -0.3]
      plot for [k = 1:2] csv skip 1 using (error(kind, p, coarse, k)):(height(kind, p, k)): \
          (error(kind, p, fine, k) - error(kind, p, coarse, k)):(0) \
          with vectors nohead lw 1.6 lc rgb word(colours, k), \
        for [k = 1:2] csv skip 1 using (error(kind, p, coarse, k)):(height(kind, p, k)) \
          with points pt 7 ps 0.6 lc rgb "white", \
        for [k = 1:2] csv skip 1 using (error(kind, p, coarse, k)):(height(kind, p, k)) \
          with points pt 6 ps 0.6 lc rgb word(colours, k), \
        for [k = 1:2] csv skip 1 using (error(kind, p, fine, k)):(height(kind, p, k)) \
          with points pt 7 ps 0.7 lc rgb word(colours, k), \
        csv skip 1 using (shown(kind, p, least_x / 3)):(-$13):(after_dash(strcol(1))) \
          with labels right offset -0.5, 0
    }
    # The legend fills the strip below the panels.
    set lmargin at screen 0; set rmargin at screen 1
    set bmargin at screen 0; set tmargin at screen 45.0 / pixels
    unset title; unset xlabel; unset border; unset tics; unset grid
    set xrange [1:2]; set yrange [1:2]
    set key center center horizontal maxrows 1 width 2 samplen 1.5
    plot for [k = 1:2] NaN with points pt 7 ps 1 lc rgb word(colours, k) \
        title (k == 1 ? "deeper than rows reach" : "the others, at the wall"), \
      NaN with points pt 7 ps 1 lc rgb "#666666" title "finer points", \
      NaN with points pt 6 ps 0.8 lc rgb "#666666" title "twice the spacing"
    unset key
    unset multiplot
    unset output
  }
}
