#!/usr/bin/env bash
# Strong and weak scaling of gradpsi::petsc on this machine's cores, halos of up to 64 processes:
#     bash benchmarks/mpi.sh [--quick] [--out DIR]
# Two CSV files in DIR (build/results if none is given): mpi_scaling.csv, mpi_halo.csv. About seven minutes;
# --quick (100,000 points, up to 4 processes, only to see that all works) one.
set -euo pipefail
quick=no out=
while [ $# -gt 0 ]; do
  case $1 in
    --quick) quick=yes ;;
    --out) out=$(realpath -m "${2:?--out needs a directory}") && shift ;;
    *) echo "usage: $0 [--quick] [--out DIR]" >&2 && exit 2 ;;
  esac
  shift
done
cd "$(dirname "$0")/.."
out=${out:-$PWD/build/results}
source apps/dependencies.sh
install_missing "${gradpsi_packages[@]}" "${petsc_packages[@]}" libbenchmark-dev

cmake --preset release -DGRADPSI_WITH_PETSC=ON -DGRADPSI_BUILD_BENCHMARKS=ON
cmake --build --preset release --target gradpsi_mpi_benchmark
mkdir -p "$out"
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
benchmark() { # RANKS ARGUMENTS
  mpirun --allow-run-as-root --oversubscribe --mca mpi_yield_when_idle 1 -n "$1" \
    build/release/benchmarks/gradpsi_mpi_benchmark "${@:2}"
}
table() { awk 'NR == 1 || !/^ranks/ {print; fflush()}'; } # one header

sides_2d="316 1000 2000" sides_3d="46 100 126" halo_ranks="1 2 4 8 16 32 64" halo_sides="1000 100"
[ $quick = no ] || sides_2d=316 sides_3d=46 halo_ranks="1 2 4" halo_sides="316 46"
for ratio in 1 1000; do
  for side in $sides_2d; do
    for ranks in 1 2; do benchmark $ranks 2 $side $ratio laplacian-mixed-zoc; done
  done
  for side in $sides_3d; do
    for ranks in 1 2; do benchmark $ranks 3 $side $ratio laplacian-mixed-zoc; done
  done
done | table | tee "$out/mpi_scaling.csv"
read -r halo_2d halo_3d <<<"$halo_sides"
for ranks in $halo_ranks; do
  benchmark $ranks 2 "$halo_2d" 1 laplacian-mixed-zoc --partition-only
  benchmark $ranks 3 "$halo_3d" 1 laplacian-mixed-zoc --partition-only
done | table | tee "$out/mpi_halo.csv"
