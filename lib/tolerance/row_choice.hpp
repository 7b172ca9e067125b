#pragma once

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
  /// The points that none is good enough for, ascending.
  const std::vector<int>& left() const { return left_; }
  RowStore& rows() { return rows_; }
  const DenseVector& volumes() const { return volumes_; }

 private:
  Operator assemble(const RowCandidate& candidate, const std::vector<int>& points);
  /// See bounded_errors().
  DenseVector errors(const Operator& op, double tolerance) const;
  /// Tries the candidates that are worth it, one by one, on those of the points that are not good enough yet.
  /// With a tolerance, bounds are cut short and degrees passed over where rows can hardly be good enough.
  /// @param worth  by candidate
  void try_in_turn(const std::vector<int>& points, const std::vector<bool>& worth,
                   double tolerance);
  std::vector<bool> worth_trying(const std::vector<int>& pilots) const;
  void keep_left();

  const Accuracy& wanted_;
  Derivative derivative_;
  const Cloud& cloud_;
  std::vector<RowCandidate> candidates_;
  Nearby near_;
  AssemblyOptions assembly_;
  RowStore rows_;
  std::vector<int> least_degree_;  // of candidates that are still worth it, by point
  std::vector<int> taken_;         // whose row each point has; -1: none
  std::vector<int> left_;
  DenseVector volumes_;
};

/// How far the Gershgorin disc of row k about point i reaches to the right of 0, in units of the diagonal: 0 or
/// less for rows that no field grows by; infinity without a negative diagonal.
double gershgorin_reach(const SparseMatrix& A, int k, int i);

}  // namespace gradpsi
