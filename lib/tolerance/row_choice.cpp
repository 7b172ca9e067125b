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

/// A row whose error is so many times too large mostly needs a higher degree.
constexpr double hopeless = 3;

/// Pilots try all candidates: one in so many rows, or more where there would be fewer than those.
constexpr int most_rows_a_pilot = 32, least_pilots = 256;

int most_neighbours(const std::vector<RowCandidate>& candidates) {
  int most = 0;
  for (const RowCandidate& candidate : candidates) most = std::max(most, candidate.neighbours);
  return most;
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
      near_(cloud, within_two_spacings[cloud.dimension() - 1], most_neighbours(candidates_),
            options.threads),
      assembly_{.kernel = options.kernel,
                .on_degenerate = OnDegenerate::Zero,
                .threads = options.threads},
      rows_(cloud.size(), target(derivative).outputs(cloud.dimension())),
      least_degree_(cloud.size(), 0),
      taken_(cloud.size(), -1),
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

void RowChoice::try_in_turn(const std::vector<int>& points, const std::vector<bool>& worth,
                            double tolerance) {
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    if (!worth[c]) continue;
    std::vector<int> some;
    for (const int i : points)
      if (rows_.error(i) > wanted_.tolerance && least_degree_[i] <= degree(candidates_[c].scheme))
        some.push_back(i);
    if (some.empty()) continue;
    const Operator op = assemble(candidates_[c], some);
    const DenseVector error = errors(op, tolerance);
    for (int k = 0; k < std::ssize(some); ++k) {
      const int i = some[k];
      if (error[k] < rows_.error(i)) {
        rows_.take(op, k, candidates_[c].scheme, error[k]);
        taken_[i] = static_cast<int>(c);
      }
      if (tolerance > 0 && op.rows.degree[k] >= 0 && error[k] > hopeless * tolerance)
        least_degree_[i] = degree(candidates_[c].scheme) + 1;
    }
  }
}

/// The candidates that are worth a try where pilots ended with them, or with cheaper ones that are not.
std::vector<bool> RowChoice::worth_trying(const std::vector<int>& pilots) const {
  constexpr double share = 0.2;  // of the rows that are left, which take it
  std::vector<int> ended(candidates_.size(), 0);
  for (const int i : pilots)
    if (rows_.error(i) <= wanted_.tolerance) ++ended[taken_[i]];
  std::vector<bool> worth(candidates_.size(), false);
  auto left = static_cast<int>(pilots.size());
  int would_take = 0;
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    would_take += ended[c];
    if (would_take == 0 || would_take < share * left) continue;
    worth[c] = true;
    left -= would_take;
    would_take = 0;
  }
  return worth;
}

void RowChoice::choose() {
  const int n = cloud_.size(), stride = std::clamp(n / least_pilots, 1, most_rows_a_pilot);
  std::vector<int> pilots, others;
  for (int k = 0; k < n; ++k) (k % stride == 0 ? pilots : others).push_back(near_.order()[k]);
  std::ranges::sort(pilots);
  std::ranges::sort(others);
  const std::vector<bool> all(candidates_.size(), true);
  try_in_turn(pilots, all, wanted_.tolerance);
  std::vector<bool> worth = worth_trying(pilots);
  try_in_turn(others, worth, wanted_.tolerance);
  worth.flip();
  try_in_turn(others, worth, wanted_.tolerance);
  // Where nothing seemed good enough, all candidates in earnest.
  keep_left();
  std::ranges::fill(least_degree_, 0);
  try_in_turn(left_, all, 0);
  keep_left();
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
