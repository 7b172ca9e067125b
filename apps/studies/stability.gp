# Draws the stability study's figures from its CSV files: maps of growth per scheme, spectra, histories.
# Set before: maps (a file), suffix ("" or, for example, "_3d"), closely (1: the files of single cases
# are there).

set datafile separator ","
set encoding utf8

schemes = "direct-zoc diffuse-zoc diffuse-ns-zoc mixed-zoc morris kgf-improved positive " . \
  "direct-soc diffuse-soc diffuse-ns-soc mixed-soc cspm icspm rkpm-2 " . \
  "diffuse-soc-ls diffuse-ns-soc-ls mixed-soc-ls msph mls-2 mls-3 kgf " . \
  "- ls-2 ls-3 ls-4 ls-5 ls-6 mls-4"
walls = "periodic dirichlet truncated"
wall_title(wall) = wall eq "periodic" ? "periodic box" : \
  wall eq "dirichlet" ? "outermost layer held" : "cut off, no condition"
place(ratio) = ratio < 2.2 ? 1 : ratio < 2.7 ? 2 : ratio < 3.2 ? 3 : ratio < 4 ? 4 : 5
stable = "#cfe3f1"

set palette defined (-3 "#fdd49e", -1 "#fc8d59", 1 "#d7301f", 3 "#7f0000", 5 "#1a0000")
set cbrange [-3:5]
do for [wall in walls] {
  set terminal pngcairo size 1400, 930 enhanced font "DejaVu Sans,10" background "white"
  set output "stability_map_".wall.suffix.".png"
  set multiplot title "Growth rate times dx^2, the largest of all seeds: ".wall_title(wall) \
    font "DejaVu Sans,13" offset 0, -0.3
  unset key; unset colorbox
  set xrange [0.5:5.5]; set yrange [-0.05:0.55]
  set tics scale 0 nomirror
  do for [k = 1:words(schemes)] {
    scheme = word(schemes, k)
    column = (k - 1) % 7; row = (k - 1) / 7
    set lmargin at screen 0.04 + 0.1365 * column; set rmargin at screen 0.04 + 0.1365 * column + 0.121
    set tmargin at screen 0.92 - 0.222 * row; set bmargin at screen 0.92 - 0.222 * row - 0.172
    if (scheme eq "-") {
      # The key takes the place of a panel.
      set colorbox user origin 0.06, 0.125 size 0.016, 0.1
      set cbtics ("0.001" -3, "0.1" -1, "10" 1, "1,000" 3, "100,000" 5) font ",9"
      set label 1 "grows" at screen 0.055, 0.24 font ",10"
      set label 2 "stable" at screen 0.08, 0.098 font ",10"
      set object 1 rectangle from screen 0.06, 0.09 to screen 0.074, 0.106 fc rgb stable fs border lc rgb "#888888"
      unset border; unset xtics; unset ytics; unset title; unset xlabel; unset ylabel
      plot NaN with points palette notitle
      unset label 1; unset label 2; unset object 1; unset colorbox
      set border
      continue
    }
    set title scheme offset 0, -0.7 font ",11"
    set xtics scale 0 ("2" 1, "2.5" 2, "3" 3, "3.5" 4, "4.5" 5)
    set ytics scale 0 0, 0.1, 0.5
    set format y (k % 7 == 1 || k == 23 ? "%g" : "")
    if (row == 3) { set xlabel "h / dx" offset 0, 0.6 } else { unset xlabel }
    if (column == 0) { set ylabel "jitter / dx" offset 1.2, 0 } else { unset ylabel }
    matches(name, which) = name eq "laplacian-".scheme && which eq wall
    plot maps skip 1 using (matches(strcol(1), strcol(2)) && $5 == 0 ? place($3) : NaN):4:(0.5):(0.05) \
        with boxxyerror fs solid 1 border lc rgb "white" fc rgb stable, \
      maps skip 1 using (matches(strcol(1), strcol(2)) && $5 > 0 ? place($3) : NaN):4:(0.5):(0.05):(log10($5)) \
        with boxxyerror fs solid 1 noborder fc palette
  }
  unset multiplot
}

if (closely) {
  reset
  set datafile separator ","
  set encoding utf8
  good = "laplacian-positive"; bad = "laplacian-direct-soc"
  blue = "#0072b2"; red = "#d55e00"; grey = "#666666"

  # The step is that at which the good scheme just stays stable with RK4.
  stats "spectra.csv" skip 1 using (strcol(1) eq good ? $2 : NaN) name "G" nooutput
  dt = 2.785 / -G_min
  set terminal pngcairo size 1100, 480 enhanced font "DejaVu Sans,11" background "white"
  set output "spectra.png"
  set multiplot layout 1, 2
  set xlabel "Re dt {/Symbol l}"; set ylabel "Im dt {/Symbol l}"
  set grid lc rgb "#e4e4e4"; set tics scale 0.5
  set xrange [-5:3]; set yrange [-3.5:3.5]
  set key bottom right
  do for [scheme in good." ".bad] {
    set title scheme
    stats "spectra.csv" skip 1 using (strcol(1) eq scheme && ($2 * dt > 3 || $2 * dt < -5) ? 1 : 0) name "O" nooutput
    if (O_sum > 0) {
      set label 1 sprintf("%d more outside the frame", int(O_sum)) at graph 0.03, 0.06 font ",10" tc rgb grey
    } else { unset label 1 }
    set arrow 1 from 0, graph 0 to 0, graph 1 nohead lc rgb "#999999" dt 3
    plot "spectra.csv" skip 1 using (strcol(1) eq scheme ? $2 * dt : NaN):($3 * dt) \
        with points pt 7 ps 0.5 lc rgb (scheme eq good ? blue : red) title "eigenvalues", \
      "rk4_region.csv" skip 1 using 1:2 with lines lc rgb grey lw 1.5 title "RK4 is stable inside"
  }
  unset multiplot
  unset label 1; unset arrow 1

  set datafile separator ","
  set terminal pngcairo size 900, 520 enhanced font "DejaVu Sans,11" background "white"
  set autoscale xy
  stats "history.csv" skip 1 using 3 name "S" nooutput
  set output "history.png"
  set title "Diffusion on 20 x 20 jittered points, walls held at 0"
  set logscale y; set format y "10^{%L}"
  set xrange [0:0.05]; set yrange [1e-1:1e12]
  set xlabel "time"; set ylabel "largest |u|"
  set key outside right
  is(scheme, stepper, coarse) = strcol(1) eq scheme && strcol(2) eq stepper && ($3 > 1.5 * S_min) == coarse
  plot for [scheme in bad." ".good] for [k = 1:3] \
    "history.csv" skip 1 using (is(scheme, k == 1 ? "explicit" : "implicit", k == 3) ? $4 : NaN):5 \
    with lines lw 2 dt k lc rgb (scheme eq good ? blue : red) \
    title sprintf("%s, %s", substr(scheme, 11, 40), k == 1 ? "explicit" : k == 2 ? "implicit" : "implicit, 10 dt")

  set output "floor.png"
  set title "Second derivative in 1D, laplacian-mixed-soc, h/dx = 2.5, jitter 0.2"
  set logscale xy; set format xy "10^{%L}"
  set autoscale xy
  set xlabel "spacing dx"; set ylabel "error, condition number"
  set key outside right
  plot "floor.csv" skip 1 using 1:2 with linespoints pt 7 lc rgb blue lw 2 title "error, moments in units of h", \
    "" skip 1 using 1:3 with points pt 6 ps 1.6 lc rgb red lw 1.5 title "error, moments in lengths", \
    "" skip 1 using 1:6 with lines dt 2 lc rgb grey lw 2 title "eps |u| / dx^2", \
    "" skip 1 using 1:4 with lines lc rgb blue title "condition, units of h", \
    "" skip 1 using 1:5 with lines lc rgb red title "condition, lengths"
}
