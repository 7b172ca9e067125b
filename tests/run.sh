#!/usr/bin/env bash
# Proves what must hold before a change lands, in 15 minutes on two cores from a clean clone; installs what is
# missing:
#     bash tests/run.sh          dev with its tests; library, solvers and fuzz corpus under sanitizers
#     bash tests/run.sh --all    what takes longer, too: sweeps, sanitizers over everything, threads, valgrind, fuzzers
# It prints the seconds of each step.
set -euo pipefail
cd "$(dirname "$0")/.."
all=false
case "${1-}" in
  "") ;;
  --all) all=true ;;
  *) echo "usage: bash tests/run.sh [--all]" >&2; exit 2 ;;
esac

seconds=()
step() {  # name, command
  local start=$SECONDS
  echo "== $1"
  "${@:2}"
  seconds+=("$(printf '%5d s  %s' $((SECONDS - start)) "$1")")
}
trap 'printf "%s\n" "${seconds[@]}" "$(printf "%5d s  in all" $SECONDS)"' EXIT

install_packages() {
  source apps/dependencies.sh
  local more=()
  if $all; then more=(clang libclang-rt-dev libomp-dev valgrind); fi
  install_missing "${gradpsi_packages[@]}" libgtest-dev libgmock-dev libbenchmark-dev python3 \
    python3-meshio python3-scipy python3-pytest python3-matplotlib python3-dev pybind11-dev \
    doxygen groff "${petsc_packages[@]}" "${more[@]}"
}
# Arguments: preset, options of CMake
build() {
  cmake --preset "$1" "${@:2}"
  cmake --build --preset "$1"
}
run_tests() { ctest --preset "$1" -j "$(nproc)" "${@:2}"; }

valgrind_small_tests() {
  OPENBLAS_NUM_THREADS=1 valgrind -q --suppressions=tests/valgrind.supp --error-exitcode=9 --leak-check=full \
    --errors-for-leak-kinds=definite build/dev/tests/gradpsi_tests --gtest_brief=1 \
    --gtest_filter='Csv.*:Market.*:Write.*:Fault2*:Cloud*:Kernel*:Invert*:Scheme*:Product*:Neighbours*'
}
fuzz() {  # target
  mkdir -p "build/corpus/$1"
  ASAN_OPTIONS=detect_leaks=0 OMP_NUM_THREADS=1 "build/fuzz/tests/fuzz/fuzz_$1" -max_total_time=60 -max_len=512 \
    -print_final_stats=1 "build/corpus/$1" "tests/fuzz/corpus/$1"
}

step "install what is missing" install_packages
petsc=OFF
if pkg-config --exists PETSc; then petsc=ON; else echo "No PETSc: gradpsi::petsc is not tested" >&2; fi

if ! $all; then
  # GCC collects its garbage less often, which takes a few percent less time.
  debug="-g1 --param=ggc-min-heapsize=300000"
  step "dev: build" build dev -DGRADPSI_WITH_PETSC=$petsc -DGRADPSI_BUILD_BENCHMARKS=OFF \
    -DCMAKE_CXX_FLAGS_DEBUG="$debug"
  step "dev: tests" run_tests dev -LE long
  # Left to --all: checks of each pointer by itself, which take half of the time that compiling takes (without them
  # GCC takes some variables for uninitialized that are not); tests compiled with sanitizers, instead of those that dev
  # has compiled; and what is about threads, long runs, or other laws of the same rows.
  step "asan: build" build asan -DGRADPSI_WITH_PETSC=OFF -DGRADPSI_BUILD_APPS=OFF \
    -DGRADPSI_TESTS_COMPILED_IN="$PWD/build/dev" \
    -DCMAKE_CXX_FLAGS_DEBUG="$debug -fno-sanitize=null,alignment,object-size,vptr,pointer-overflow -Wno-maybe-uninitialized"
  skipped=*Threads*:*Momentum*:*OneByOne:*StartNone:*LeastSquares*:Forecast.AgreesWithTheSpectrum
  export GTEST_FILTER=-$skipped:Consistency/*:Invariance/Invariant*:Schemes/Hessian*
  export ASAN_OPTIONS=malloc_context_size=3
  step "asan: tests" run_tests asan
  exit
fi
step "dev: build" build dev -DGRADPSI_WITH_PETSC=$petsc -DGRADPSI_BUILD_BENCHMARKS=ON
step "dev: tests" run_tests dev
step "valgrind: small tests" valgrind_small_tests
step "asan: build" build asan -DGRADPSI_WITH_PETSC=$petsc -DGRADPSI_BUILD_APPS=ON -DGRADPSI_TESTS_COMPILED_IN=
step "asan: tests" run_tests asan
step "tsan: build" build tsan
step "tsan: tests" run_tests tsan
step "fuzz: build" build fuzz
for target in csv matrix_market assemble; do step "fuzz: $target, a minute" fuzz $target; done
