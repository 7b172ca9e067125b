#!/usr/bin/env bash
# Builds and installs gradpsi, runs the examples, reproduces the paper's figures, differentiates a field on
# real points and lets heat diffuse through them:
#     bash apps/run.sh
# Everything it makes is below build/.
set -euo pipefail
cd "$(dirname "$0")/.."
source apps/dependencies.sh
install_missing "${gradpsi_packages[@]}"

cmake --preset release
cmake --build --preset release
gradpsi=build/release/apps/gradpsi
results=build/results
mkdir -p $results

echo
echo "== Four programs linked to the installed library (apps/examples) =="
cmake --install build/release --prefix build/installed >/dev/null
cmake -S apps/examples -B build/examples -G Ninja -DCMAKE_PREFIX_PATH="$PWD/build/installed" >/dev/null
cmake --build build/examples >/dev/null
for example in 1_gradient 2_heat 3_own_kernel 4_choosing; do
  echo "$example:"
  build/examples/$example | sed 's/^/  /'
done

echo
echo "== The paper's study: error against spacing, 17 schemes =="
$gradpsi converge --quick --out $results

echo
echo "== Where Laplacians grow, what was foretold, and what cures it =="
$gradpsi stability --quick --out $results

echo
echo "== Accuracy against cost: every scheme, two supports, two resolutions =="
$gradpsi tradeoff --quick --out $results | tail -n 12

echo
echo "== Real points: the letters S, P, H (3,993 scattered points in 3D, apps/data) =="
echo "u = sin(8x) cos(7y) exp(3z); what its derivatives should be is known."
awk -F, 'NR == 1 {print $0 ",u"} NR > 1 {printf "%s,%.17g\n", $0, sin(8*$1) * cos(7*$2) * exp(3*$3)}' \
  apps/data/letters.csv >$results/letters.csv

# derive SCHEME COLUMNS: differentiates u and prints errors relative to the largest exact value.
derive() {
  $gradpsi derive $results/letters.csv --field u --scheme "$1" --support-ratio 3 \
    --on-degenerate lower -o "$results/$1.csv" >"$results/$1.log"
  awk -F, -v scheme="$1" '
    NR == 1 {next}
    {
      x = $1; y = $2; e = exp(3*$3)
      if (NF == 7) {
        gx = 8 * cos(8*x) * cos(7*y) * e; gy = -7 * sin(8*x) * sin(7*y) * e
        gz = 3 * sin(8*x) * cos(7*y) * e
        error = sqrt(($5-gx)^2 + ($6-gy)^2 + ($7-gz)^2); exact = sqrt(gx^2 + gy^2 + gz^2)
      } else {
        exact = (9 - 64 - 49) * $4; error = sqrt(($5-exact)^2); exact = sqrt(exact^2)
      }
      print error; if (exact > largest) largest = exact
    }
    END {print "largest", largest}' "$results/$1.csv" | sort -g |
    awk -v scheme="$1" '$1 == "largest" {largest = $2; next} {error[n++] = $1}
      END {printf "%-24s median %8.1e   95 %% below %8.1e   worst %8.1e\n", scheme,
           error[int(n/2)] / largest, error[int(0.95*n)] / largest, error[n-1] / largest}'
  grep degenerate "$results/$1.log" || true
}
echo "Errors relative to the largest exact value:"
for scheme in gradient-direct-zoc gradient-direct-foc gradient-direct-soc \
  laplacian-mixed-zoc laplacian-mixed-soc; do
  derive $scheme
done
$gradpsi derive $results/letters.csv --field u --scheme gradient-direct-soc --support-ratio 3 \
  --on-degenerate lower -o $results/letters.vtu >/dev/null
echo "What should be taken there, for 5 % on waves of length 0.5?"
$gradpsi advise $results/letters.csv --operator laplacian --tolerance 0.05 --wavelength 0.5 | sed -n 3,5p

echo
echo "== Diffusion: orders in time and space, a Poisson problem, a slab of two conductivities =="
build/release/apps/gradpsi_diffusion_study >$results/diffusion_study.csv
awk -F, 'NR > 1 {
    line = sprintf("%-7s  %sD  %-7s  jitter %-3s  %-19s  h/dx %-3s", $1, $2, $3, $4, $5, $6)
    if (line != before && before != "") print before result
    before = line; result = sprintf("  error %8.1e", $8) ($9 == "" ? "" : "  order " $9)
  } END {print before result}' $results/diffusion_study.csv

echo
echo "== Heat in the letters: ends at x <= 2.101 held at 1, at x >= 2.449 at 0, steady state =="
# Turned by a quarter, so that the letters stand upright: (x, y) becomes (y, -x).
awk -F, 'NR == 1 {print "x,y,z,T,ends"}
  NR > 1 {hot = ($1 <= 2.101); print $2 "," (-$1) "," $3 "," hot "," (hot || $1 >= 2.449)}' \
  apps/data/letters.csv >$results/heat_start.csv

# heat SCHEME OPTIONS: solves, and compares with what is known: the bars of the H are straight, so that T
# falls linearly along them (but for the joint with the crossbar); the S is symmetric, so that T = 1/2 at
# its centre.
heat() {
  echo "$1 ${*:2}:"
  local out=$results/heat_$1.csv
  if ! $gradpsi diffuse $results/heat_start.csv --field T --scheme "$1" --support-ratio 3 \
    --fixed ends "${@:2}" -o "$out" >$results/heat.log 2>&1; then
    fold -s -w 110 $results/heat.log | sed 's/^/  /'
    return
  fi
  sed -n '/was in/,/picture/ {/picture/!p}' $results/heat.log | sed 's/^ */  /'
  awk -F, 'NR == 1 {next}
    $1 > 0.299 && ($1 < 0.351 || $1 > 0.449) && $5 == 0 {
      e = $4 - (2.449 + $2) / 0.348
      sum += e^2; ++n; if (e^2 > worst) worst = e^2
    }
    ($1 + 0.1)^2 + ($2 + 2.275)^2 < 0.02^2 {centre += $4; ++m}
    END {printf "  bars of the H: error %.4f rms, %.4f at most; centre of the S: %.3f\n",
      sqrt(sum / n), sqrt(worst), centre / m}' "$out"
}
heat laplacian-mixed-zoc --steady
heat laplacian-mixed-soc --steady
heat laplacian-mixed-zoc --time-step 0.01 --steps 200
heat laplacian-mixed-soc --time-step 0.01 --steps 200
heat laplacian-mixed-zoc --steady >/dev/null # its picture is the one to keep

echo
echo "Look at $results/figure1.png and $results/figure2.png (the paper's Figs. 1 and 2 down to"
echo "spacing 1e-4), at $results/heat_laplacian-mixed-zoc.png, heat in the letters, and at"
echo "$results/letters.vtu in ParaView. The full study, down to 1e-6, takes a minute:"
echo "$gradpsi converge --out $results"
