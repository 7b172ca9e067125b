#pragma once

#include <cstdint>
#include <vector>

#include "gradpsi/tolerance.hpp"
#include "tolerance/candidates.hpp"
#include "tolerance/nearby.hpp"
#include "tolerance/row_store.hpp"

namespace gradpsi {

/// Tries the candidates on the rows of a cloud of two points or more.
class RowChoice {
 public:
  RowChoice(const Accuracy& wanted, Derivative derivative, const Cloud& cloud,
            const ToleranceOptions& options);

  /// One candidate after the other, each on the rows that are not good enough yet; rows that none is good enough
  /// for have the best.
  void choose();
  /// Takes, of the rows that are good enough, those whose Gershgorin discs reach least far to the right.
  /// @param points  ascending
  void choose_anew(const std::vector<int>& points);
  /// The `count` nearest points of point i and more.
  std::vector<int> around(int i, int count);

  const Cloud& cloud() const { return cloud_; }
  const std::vector<int>& left() const {
    return left_;
  }  ///< that none is good enough for, ascending
  RowStore& rows() { return rows_; }
  const DenseVector& volumes() const { return volumes_; }

 private:
  Operator assemble(const RowCandidate& candidate, const std::vector<int>& points);
  DenseVector errors(const Operator& op) const;
  /// Candidate c on the rows that are left and have not tried it. Those whose error is `hopeless` times too large
  /// skip its degree.
  void attempt(int c, double hopeless);
  void certify();

  const Accuracy& wanted_;
  Derivative derivative_;
  const Cloud& cloud_;
  std::vector<RowCandidate> candidates_;
  Nearby near_;
  AssemblyOptions assembly_;
  RowStore rows_;
  std::vector<int> least_degree_;     // of candidates that are still worth it
  std::vector<std::uint64_t> tried_;  // a bit for each candidate
  std::vector<int> left_;
  DenseVector volumes_;
};

/// How far the Gershgorin disc of row k about point i reaches to the right of 0, in units of the diagonal: 0 or
/// less for rows that no field grows by; 2 or more without a negative diagonal.
double gershgorin_reach(const SparseMatrix& A, int k, int i);

}  // namespace gradpsi
