#!/usr/bin/env bash
# Builds and runs the benchmarks, prints tables, draws figures:
#     bash benchmarks/run.sh [--quick] [--out DIR]
# Everything goes to DIR, build/results if none is given: benchmarks.json, .md, .dat and the figures. On two
# cores that have nothing else to do it takes about ten minutes, --quick (up to 100,000 points, a single run
# of each, only to see that all works) one.
set -euo pipefail
quick=() out=
while [ $# -gt 0 ]; do
  case $1 in
    --quick) quick=(--quick --benchmark_min_time=0.01) ;;
    --out) out=$(realpath -m "${2:?--out needs a directory}") && shift ;;
    *) echo "usage: $0 [--quick] [--out DIR]" >&2 && exit 2 ;;
  esac
  shift
done
options=("${quick[@]}")
[ ${#quick[@]} -gt 0 ] || options=(--benchmark_min_time=0.1 --benchmark_repetitions=3
  --benchmark_report_aggregates_only)
cd "$(dirname "$0")/.."
out=${out:-$PWD/build/results}
source apps/dependencies.sh
install_missing "${gradpsi_packages[@]}" libbenchmark-dev python3

cmake --preset release -DGRADPSI_BUILD_BENCHMARKS=ON
cmake --build --preset release --target gradpsi_benchmarks
mkdir -p "$out"
# The log has what the JSON has, and what failed.
build/release/benchmarks/gradpsi_benchmarks "${options[@]}" \
  --benchmark_out="$out/benchmarks.json" >"$out/benchmarks.log" 2>&1 ||
  { tail -n 20 "$out/benchmarks.log" >&2 && exit 1; }

python3 benchmarks/report.py "$out/benchmarks.json" --dat "$out" | tee "$out/benchmarks.md"
gnuplot -e "results = '$out'" benchmarks/benchmarks.gp
echo
echo "Look at $out/benchmarks_{sizes,roof,orders}.png; the tables are in $out/benchmarks.md."
