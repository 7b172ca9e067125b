# Draws the convergence study's figures from its CSV: error against spacing, one panel per
# consistency and arrangement, a colour per weight, a line style per support ratio.
# Set before: csv, suffix ("" or, for example, "_2d"), error_column, error_name.

set datafile separator ","
set encoding utf8
set logscale xy
set format xy "10^{%L}"
set border lw 0.8
set tics scale 0.6

eps = 2.2e-16
u_max = 2
weights = "direct diffuse diffuse-ns mixed"
colours = "#0072b2 #d55e00 #009e73 #aa3377"
ratios = "2.5 3.5 4.5"
arrangements = "regular irregular"

selected(scheme, arrangement, ratio) = \
  strcol(1) eq scheme && strcol(2) eq arrangement && abs($3 - ratio) < 1e-9
of_kind(kind, consistency) = \
  strstrt(strcol(1), kind) == 1 && strstrt(strcol(1), "-".consistency) > 0

# Out of sight in two and three dimensions.
rounding(figure) = suffix ne "" ? " " : "rounding, eps |u| / dx".(figure == 1 ? "" : "^2")

# Slopes that a panel is compared with.
orders(consistency) = consistency eq "zoc" ? (kind eq "gradient" ? "none" : "-1") : "1 2"
slope_dash(order) = order eq "-1" ? 3 : order eq "1" ? 1 : 4

stats csv skip 1 using 5 name "X" nooutput
if (X_max / X_min < 30) {
  set xtics 0.003125, 2
  set format x "%g"
}

do for [format in "svg png"] {
  do for [figure = 1:2] {
    kind = figure == 1 ? "gradient" : "laplacian"
    consistencies = figure == 1 ? "zoc foc soc" : "zoc soc"
    rows = words(consistencies)
    weight_count = figure == 1 ? 3 : 4
    pixels = 360 * rows + 105
    height = (1 - 105.0 / pixels) / rows
    if (format eq "svg") {
      set terminal svg size 1000, pixels enhanced font "DejaVu Sans,13" background "white"
    } else {
      set terminal pngcairo size 1000, pixels enhanced font "DejaVu Sans,11" background "white"
    }
    set output sprintf("figure%d%s.%s", figure, suffix, format)
    set multiplot
    set border; set tics; unset key
    set grid lc rgb "#e4e4e4" lw 0.6 dt 1
    do for [row = 1:rows] {
      consistency = word(consistencies, row)
      # Both panels of a row share the range of their curves, so that they compare at a glance.
      set autoscale xy  # ranges set before would hide points from stats
      stats csv skip 1 using (of_kind(kind, consistency) ? $5 : NaN) : \
        (of_kind(kind, consistency) ? column(error_column) : NaN) name "S" nooutput
      set xrange [X_min / 1.4 : X_max * 1.4]
      set yrange [S_min_y / 5 : S_max_y * 4]
      do for [c = 1:2] {
        arrangement = word(arrangements, c)
        set size 0.5, height
        set origin 0.5 * (c - 1), 1 - height * row
        set title (figure == 1 ? "First derivative, " : "Second derivative, ").\
          (consistency eq "zoc" ? "ZOC, " : consistency eq "foc" ? "FOC, " : "SOC, ").arrangement
        set xlabel (row == rows ? "spacing dx" : "")
        set ylabel (c == 1 ? error_name : "")
        plot for [w = 1:weight_count] for [k = 1:3] csv skip 1 using 5 : \
            (selected(kind."-".word(weights, w)."-".consistency, arrangement, word(ratios, k) + 0) \
             ? column(error_column) : NaN) \
            with lines lw 1.8 lc rgb word(colours, w) dt k, \
          for [order in orders(consistency)] \
            (order eq "none" ? NaN : \
              2 * S_max_y * (x / (order eq "-1" ? S_min_x : S_max_x))**(order + 0)) \
            with lines lw 1 lc rgb "#777777" dt slope_dash(order), \
          eps * u_max / x**figure with lines lw 1.4 lc rgb "black" dt 5
      }
    }
    # The legend fills the strip below the panels.
    set size 1, 1 - height * rows
    set origin 0, 0
    unset title; unset xlabel; unset ylabel; unset border; unset tics; unset grid
    set xrange [1:2]; set yrange [1:2]
    set key center center horizontal maxcols 4 width 2 samplen 3.5 spacing 1.3
    set key center center horizontal maxcols 3 maxrows weight_count width 3 samplen 3.5 spacing 1.3
    plot for [w = 1:weight_count] NaN with lines lw 3 lc rgb word(colours, w) title word(weights, w), \
      for [k = 1:3] NaN with lines lw 1.8 lc rgb "black" dt k title "h/dx = ".word(ratios, k), \
      NaN with lines lw 1.6 lc rgb (suffix eq "" ? "black" : "white") dt 5 title rounding(figure), \
      for [order in "1 2".(figure == 1 ? "" : " -1")] \
        NaN with lines lw 1 lc rgb "#777777" dt slope_dash(order) title "order ".order
    unset multiplot
    unset output
  }
}
