# Sourced by apps/run.sh and tests/run.sh: installs the Debian packages named as arguments that are
# missing; where there is no apt, says what is needed and leaves it to the reader.

install_missing() {
  if ! command -v apt-get >/dev/null; then
    echo "This is not Debian. Needed (Debian's names): $*" >&2
    return
  fi
  local package missing=()
  for package in "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' ||
      missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  echo "Installing ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

gradpsi_packages=(g++ cmake ninja-build libeigen3-dev libnanoflann-dev libspectra-dev
  libsuitesparse-dev libopenblas0-pthread libcli11-dev nlohmann-json3-dev gnuplot-nox fonts-dejavu-core)
# For -DGRADPSI_WITH_PETSC=ON: PETSc with hypre, MUMPS and Zoltan, and MPI.
petsc_packages=(petsc-dev openmpi-bin pkg-config)
