#include "tolerance/row_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "operators/assemble.hpp"
#include "schemes/targets.hpp"
#include "tolerance/certificate.hpp"

namespace gradpsi {
namespace {

/// The points within two spacings of one, by dimension: what volumes by number density take.
constexpr int within_two_spacings[] = {4, 12, 32};

std::vector<RowCandidate> candidates(Derivative derivative, const Cloud& cloud, bool stable) {
  std::vector<RowCandidate> all = row_candidates(derivative, cloud.dimension(), stable);
  std::erase_if(all, [&](const RowCandidate& c) { return c.neighbours >= cloud.size(); });
  return all;
}

}  // namespace

double gershgorin_reach(const SparseMatrix& A, int k, int i) {
  double diagonal = 0, others = 0;
  for (SparseMatrix::InnerIterator a(A, k); a; ++a)
    (a.col() == i ? diagonal : others) += a.col() == i ? a.value() : std::abs(a.value());
  return diagonal < 0 ? others / -diagonal - 1 : std::numeric_limits<double>::infinity();
}

RowChoice::RowChoice(const Accuracy& wanted, Derivative derivative, const Cloud& cloud,
                     const ToleranceOptions& options)
    : wanted_(wanted),
      derivative_(derivative),
      cloud_(cloud),
      candidates_(candidates(derivative, cloud, options.stable)),
      near_(cloud, within_two_spacings[cloud.dimension() - 1], options.threads),
      assembly_{.kernel = options.kernel,
                .on_degenerate = OnDegenerate::Zero,
                .threads = options.threads},
      rows_(cloud.size(), target(derivative).outputs(cloud.dimension())),
      left_(cloud.size()) {
  std::iota(left_.begin(), left_.end(), 0);
  if (cloud.has_volumes())
    volumes_ = cloud.volumes();
  else
    volumes_ = number_density_volumes(
        cloud, near_.nearest(left_, within_two_spacings[cloud.dimension() - 1]), options.kernel,
        options.threads);
}

Operator RowChoice::assemble(const RowCandidate& candidate, const std::vector<int>& points) {
  assembly_.rows = points;
  return std::move(assemble_with(&cpu(), {candidate.scheme}, cloud_,
                                 near_.nearest(points, candidate.neighbours), assembly_, volumes_)
                       .front());
}

DenseVector RowChoice::errors(const Operator& op, double tolerance) const {
  return bounded_errors(derivative_, cloud_, op, wanted_.wavelengths, tolerance, assembly_.threads);
}

/// Candidate by candidate on the rows that are left, as far as bounds by norms tell. A row whose error is three times
/// too large mostly needs a higher degree.
void RowChoice::choose_at_a_glance() {
  constexpr double hopeless = 3;
  std::vector<int> least_degree(cloud_.size(), 0);  // of candidates that are still worth it
  for (const RowCandidate& candidate : candidates_) {
    const int P = degree(candidate.scheme);
    std::vector<int> points;
    for (const int i : left_)
      if (least_degree[i] <= P) points.push_back(i);
    if (points.empty()) continue;
    const Operator op = assemble(candidate, points);
    const DenseVector error = errors(op, wanted_.tolerance);
    for (int k = 0; k < std::ssize(points); ++k) {
      const int i = points[k];
      if (error[k] < rows_.error(i)) rows_.take(op, k, candidate.scheme, error[k]);
      if (op.rows.degree[k] >= 0 && error[k] > hopeless * wanted_.tolerance)
        least_degree[i] = P + 1;
    }
    keep_left();
  }
}

void RowChoice::choose() {
  choose_at_a_glance();
  rows_.report().errors = errors(rows_.operator_of(volumes_), 0);
  keep_left();
  // Where nothing seemed good enough, all candidates in earnest.
  for (const RowCandidate& candidate : candidates_) {
    if (left_.empty()) return;
    const Operator op = assemble(candidate, left_);
    const DenseVector error = errors(op, 0);
    for (int k = 0; k < std::ssize(left_); ++k)
      if (error[k] < rows_.error(left_[k])) rows_.take(op, k, candidate.scheme, error[k]);
    keep_left();
  }
}

void RowChoice::keep_left() {
  std::erase_if(left_, [&](int i) { return rows_.error(i) <= wanted_.tolerance; });
}

void RowChoice::choose_anew(const std::vector<int>& points) {
  std::vector<double> reach(points.size(), std::numeric_limits<double>::infinity());
  for (const RowCandidate& candidate : candidates_) {
    const Operator op = assemble(candidate, points);
    const DenseVector error = errors(op, 0);
    for (int k = 0; k < std::ssize(points); ++k) {
      const double right = gershgorin_reach(op.matrix(), k, points[k]);
      if (error[k] > wanted_.tolerance || right >= reach[k]) continue;
      reach[k] = right;
      rows_.take(op, k, candidate.scheme, error[k]);
    }
  }
}

std::vector<int> RowChoice::around(int i, int count) {
  const Neighbours near = near_.nearest({i}, std::min(count, cloud_.size() - 1));
  const auto list = near.of(i);
  std::vector<int> points(list.begin(), list.end());
  points.insert(std::ranges::lower_bound(points, i), i);
  return points;
}

}  // namespace gradpsi
