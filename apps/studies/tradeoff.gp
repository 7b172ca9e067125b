# Draws accuracy against cost from the CSVs of the study: a panel per cost and arrangement, colours by
# weight, shapes by consistency, hollow where du/dt = lap u grows, the Pareto front as steps.
# Set before: csv, fronts, suffix, default_kernel.

set datafile separator ","
set encoding utf8
set logscale xy
set format xy "10^{%L}"
set border lw 0.8
set tics scale 0.6

weights = "direct diffuse diffuse-ns mixed kernel distance derivatives"
colours = "#0072b2 #d55e00 #009e73 #aa3377 #000000 #cc3311 #7f7f00"
# The last are those that the paper cites.
consistencies = "zoc foc soc soc-ls positive ls- cited"
filled = "7 9 5 13 11 15 3"
hollow = "6 8 4 12 10 14 2"
arrangements = "regular irregular"
costs = "assemble product solve"
cost_names = "'search and weights, s' 'a product, s' 'search, weights and solution, s'"

is_of(kind, arrangement) = strstrt(strcol(1), kind) == 1 && strcol(5) eq arrangement
known(name) = strstrt(name, "ls-") == 1 || strstrt(" zoc foc soc soc-ls positive ", " ".name." ") > 0
same(consistency) = consistency eq "ls-" ? strstrt(strcol(19), "ls-") == 1 : \
  consistency eq "cited" ? !known(strcol(19)) : strcol(19) eq consistency
chosen(kind, arrangement, w, c) = is_of(kind, arrangement) && strcol(3) eq default_kernel && \
  strcol(18) eq word(weights, w) && same(word(consistencies, c))
# A number of this cell, not a number where the cell is empty.
number(k) = strlen(strcol(k)) > 0 ? column(k) : NaN
cost(k) = column(6) * (k == 1 ? number(13) : k == 2 ? number(14) : number(13) + number(15))
error(k) = number(k == 3 ? 11 : 9)
stable(yes) = yes ? strcol(17) ne "0" : strcol(17) eq "0"

do for [format in "svg png"] {
  do for [kind in "gradient laplacian"] {
    columns = kind eq "gradient" ? 2 : 3
    pixels_x = 400 * columns
    pixels_y = 880
    if (format eq "svg") {
      set terminal svg size pixels_x, pixels_y enhanced font "DejaVu Sans,13" background "white"
    } else {
      set terminal pngcairo size pixels_x, pixels_y enhanced font "DejaVu Sans,11" background "white"
    }
    set output sprintf("tradeoff_%s%s.%s", kind, suffix, format)
    set multiplot
    height = 0.44
    do for [row = 1:2] {
      arrangement = word(arrangements, row)
      do for [k = 1:columns] {
        set size 1.0 / columns, height
        set origin (k - 1.0) / columns, 1 - height * row
        set border; set tics; unset key
        set grid lc rgb "#e4e4e4" lw 0.6 dt 1
        set autoscale xy
        set title kind.", ".arrangement
        set xlabel (row == 2 ? word(cost_names, k) : "")
        set ylabel (k == 1 ? "L2 error of the derivative, relative" : k == 3 ? "L2 error of the solution, relative" : "")
        set yrange [*:10]
        plot csv skip 1 using (is_of(kind, arrangement) && strcol(3) ne default_kernel ? cost(k) : NaN):(error(k)) \
            with points pt 7 ps 0.15 lc rgb "#c0c0c0", \
          for [w = 1:7] for [c = 1:7] csv skip 1 \
            using (chosen(kind, arrangement, w, c) && stable(1) ? cost(k) : NaN):(error(k)) \
            with points pt (word(filled, c) + 0) ps 0.6 lc rgb word(colours, w), \
          for [w = 1:7] for [c = 1:7] csv skip 1 \
            using (chosen(kind, arrangement, w, c) && stable(0) ? cost(k) : NaN):(error(k)) \
            with points pt (word(hollow, c) + 0) ps 0.6 lw 0.8 lc rgb word(colours, w), \
          fronts skip 1 using (strcol(1) eq kind && strcol(2) eq word(costs, k) && \
            strcol(3) eq arrangement ? $4 : NaN):5 with steps lw 2 lc rgb "#e69f00", \
          csv skip 1 using (is_of(kind, arrangement) && strcol(19) eq "chosen" && stable(1) ? cost(k) : NaN):(error(k)) \
            with points pt 1 ps 1.1 lw 2 lc rgb "#00b4d8", \
          csv skip 1 using (is_of(kind, arrangement) && strcol(19) eq "chosen" && stable(0) ? cost(k) : NaN):(error(k)) \
            with points pt 2 ps 0.8 lw 1.4 lc rgb "#00b4d8"
      }
    }
    set size 1, 1 - 2 * height
    set origin 0, 0
    unset title; unset xlabel; unset ylabel; unset border; unset tics; unset grid
    set xrange [1:2]; set yrange [1:2]
    set key center center horizontal maxcols (columns == 2 ? 5 : 6) width 1 samplen 1.5 spacing 1.3
    weight_names = "direct diffuse diffuse-ns mixed W positive 'derivatives of W'"
    consistency_names = "zoc foc soc soc-ls positive ls-P 'cited (x: grows)'"
    some_weights = kind eq "gradient" ? "1 2 3 5 7" : "1 2 3 4 5 6 7"
    some_consistencies = kind eq "gradient" ? "1 2 3 6 7" : "1 3 4 5 6 7"
    plot for [w in some_weights] NaN with points pt 7 ps 1.3 lc rgb word(colours, w + 0) \
        title word(weight_names, w + 0), \
      for [c in some_consistencies] NaN with points pt (word(filled, c + 0) + 0) ps 1.3 \
        lc rgb "#666666" title word(consistency_names, c + 0), \
      NaN with points pt 6 ps 1.2 lc rgb (kind eq "gradient" ? "white" : "#666666") \
        title (kind eq "gradient" ? " " : "hollow: grows"), \
      NaN with points pt 7 ps 0.3 lc rgb "#c0c0c0" title "other kernels", \
      NaN with points pt 1 ps 1.2 lw 2 lc rgb "#00b4d8" title "chosen rows", \
      NaN with lines lw 2 lc rgb "#e69f00" title "Pareto front"
    unset multiplot
    unset output
    set autoscale
  }
}
