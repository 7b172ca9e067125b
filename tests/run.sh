#!/usr/bin/env bash
# Installs what is missing, builds the dev and asan presets and runs all tests in both:
#     bash tests/run.sh       (on two cores about 35 minutes, 12 when already built)
set -euo pipefail
cd "$(dirname "$0")/.."
source apps/dependencies.sh
install_missing "${gradpsi_packages[@]}" libgtest-dev libgmock-dev libbenchmark-dev python3 \
  python3-meshio python3-scipy python3-pytest python3-matplotlib python3-dev pybind11-dev \
  doxygen groff "${petsc_packages[@]}"

with_petsc=OFF
if pkg-config --exists PETSc; then with_petsc=ON; else echo "No PETSc: gradpsi::petsc is not tested" >&2; fi
for preset in dev asan; do
  cmake --preset $preset -DGRADPSI_WITH_PETSC=$with_petsc
  cmake --build --preset $preset
  ctest --preset $preset -j "$(nproc)"
done
