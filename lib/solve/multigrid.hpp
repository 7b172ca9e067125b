#pragma once

#include <string>
#include <vector>

#include "solve/coarse_cycle.hpp"
#include "solve/row_correction.hpp"
#include "solve/system.hpp"

namespace gradpsi {

/// Multigrid on the points, as a preconditioner: the user's matrix smooths on the finest level, coarser ones have
/// compact operators made for their points. What a diagonal cannot smooth is corrected by factors of its own:
/// rows at walls, and with `weak_rows` those in which the diagonal is not strong.
class Multigrid {
 public:
  /// Symmetric and positive definite after scaling by volume, where the matrix is and without weak rows. Coarser
  /// points are kept from one matrix to the next, though points may have moved, where the medium is nearly a multiple
  /// of what it was, until they are given up.
  /// @param system  with points and volumes
  /// @throws NoHierarchy  if there can be no coarser points, or too many rows are weak
  void prepare(const LinearSystem& system, bool weak_rows);

  bool is_kept() const { return is_kept_; }  ///< the coarser points are those of an earlier matrix
  void give_up() { coarse_.clear(); }  ///< the next matrix, which must come first, makes them anew

  /// z = about A^-1 r, n each.
  void apply(const LinearSystem& system, const double* r, double* z);

  std::string description() const;  ///< "multigrid on .. levels of points"
  FactorReport report() const;  ///< entries of all levels' matrices and the memory that it holds

 private:
  double prepare_smoother(const LinearSystem& system);
  bool keep_levels(const LinearSystem& system, const Medium& medium);
  std::string words_of_weak_rows(const LinearSystem& system) const;
  void prepare_weak_rows(const LinearSystem& system);

  CoarseCycle coarse_;
  Medium medium_;                  // that its matrices are of
  std::vector<int> without_;       // the walls that it was made without
  double unit_ = 1;                // of their matrices and residuals
  DenseVector step_, weight_, r_;  // of the finest level: the smoother's, the residual's, memory
  std::vector<char> is_weak_;      // rows
  RowCorrection walls_, weak_;
  int weak_count_ = 0, threads_ = 1;
  bool is_kept_ = false;
};

}  // namespace gradpsi
