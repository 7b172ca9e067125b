#!/usr/bin/env bash
# Installs what is missing, builds the dev and asan presets and runs all tests in both, then the solvers'
# tests in a build without CHOLMOD:
#     bash tests/run.sh       (on two cores 15 to 20 minutes, 5 when already built)
set -euo pipefail
cd "$(dirname "$0")/.."
source apps/dependencies.sh
install_missing "${gradpsi_packages[@]}" libgtest-dev libgmock-dev libbenchmark-dev python3 \
  python3-meshio python3-scipy

for preset in dev asan; do
  cmake --preset $preset
  cmake --build --preset $preset
  # Of about 900 tests, those that fail and the count are of interest.
  ctest --preset $preset -j "$(nproc)" --output-on-failure | grep -vE '^ +Start |  Passed  '
done

cmake --preset dev -B build/without-cholmod -DGRADPSI_WITH_CHOLMOD=OFF -DCMAKE_CXX_FLAGS=-O1 \
  -DGRADPSI_BUILD_APPS=OFF -DGRADPSI_BUILD_BENCHMARKS=OFF
cmake --build build/without-cholmod --target gradpsi_tests
build/without-cholmod/tests/gradpsi_tests --gtest_brief=1 \
  --gtest_filter='*Solver*:*Diffusion*:*Conductivity*:*Dissection*:*Twin*'
