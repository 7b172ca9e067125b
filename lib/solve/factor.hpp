#pragma once

#include <Eigen/Core>
#include <stdexcept>

#include "base/text.hpp"
#include "gradpsi/solver.hpp"

namespace gradpsi {

/// An elimination order: one that is given, or the way in which the factorisation finds its own.
struct Elimination {
  Ordering ordering = Ordering::Amd;  // Coordinates: `permutation`
  Eigen::VectorXi permutation = {};   // the k-th unknown to go is permutation[k]
  double seconds = 0;                 // what finding it took; part of the analysis
};

/// A factor would take more than the memory given.
struct FactorTooLarge : std::runtime_error {
  FactorTooLarge(double needed, double given)  // bytes
      : std::runtime_error("its factor would take " + rounded(needed / 1e9) + " GB of the " +
                           rounded(given / 1e9) + " GB given") {}
};

}  // namespace gradpsi
