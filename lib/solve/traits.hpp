#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "solve/system.hpp"

namespace gradpsi {

/// What is known of a system: what its method is chosen by.
struct Traits {
  std::int64_t unknowns = 0;
  int dimension = 1;        // of the points; 1 if there are none
  bool symmetric = false;   // after scaling its rows by volume
  bool indefinite = false;  // a Cholesky factorisation has met a pivot that is not positive
  bool dominant = false;    // no diagonal entry is less than the others of its row together
  bool reversed = false;    // some rows are reversed_rows(): iterations are unlikely to converge
  bool walls = false;       // some rows hold a boundary condition
  bool spread = false;      // over processes, none of which sees the others' rows
  /// dt nu / dx^2 at the median row; infinity: a steady problem; NaN: there are no volumes to tell.
  double stiffness = std::numeric_limits<double>::quiet_NaN();
  int solves = 1;  // that are expected for each matrix

  /// Whether points and their volumes are known.
  bool has_volumes() const { return !std::isnan(stiffness); }
};

/// As many solves as are expected where nobody says.
inline int expected_solves(const SolverOptions& options) {
  return options.solves > 0 ? options.solves : 100;
}

/// Of a system whose rows are all here.
Traits traits(const LinearSystem& system);

/// Throws InvalidInput unless all entries are finite and no row has only zeros; `name` says what row i is called.
void check_rows(const SparseMatrix& A, const std::function<std::string(int)>& name);

/// What some of a system's rows contribute to its traits.
struct RowTraits {
  bool dominant;          // all of them
  DenseVector stiffness;  // of each; infinity where it sums to zero; none if there are no volumes
};
/// Rows and `diagonal` as in twin.hpp.
RowTraits row_traits(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                     int threads);

}  // namespace gradpsi
