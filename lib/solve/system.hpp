#pragma once

#include <Eigen/Core>
#include <numeric>
#include <string>
#include <vector>

#include "gradpsi/solver.hpp"

namespace gradpsi {

/// A x = b as its solver's methods see it.
struct LinearSystem {
  SparseMatrix A = {};             // n x n
  SystemPoints points = {};        // of the unknowns, or none
  SolverOptions options = {};      // memory: bytes
  Eigen::VectorXd scale = {};      // of rows: the points' volumes, or 1
  DenseVector diffusivities = {};  // of rows, see medium.hpp, if the points have volumes

  /// Constants are in the null space: A x + c = b is solved for x of SolverOptions::mean.
  bool floats = false;

  int size() const { return static_cast<int>(A.rows()); }
  bool has_points() const { return points.cloud.size() > 0; }
  /// What row i is called in messages.
  std::string row(int i) const {
    return has_points() ? "point " + std::to_string(points.cloud.number(i))
                        : "row " + std::to_string(i);
  }
  /// The column of each row's diagonal entry, which functions of some of a matrix's rows ask for: 0 to n - 1.
  std::vector<int> diagonal() const {
    std::vector<int> columns(size());
    std::iota(columns.begin(), columns.end(), 0);
    return columns;
  }
};

}  // namespace gradpsi
