#include "tolerance/stable.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <string>

#include "base/dispatch.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spectrum.hpp"
#include "tolerance/directions.hpp"

namespace gradpsi {
namespace {

/// As many points as a block of forecast() has, to begin with.
constexpr int block = 30;

/// The points around the growth, and those whose discs reach at least as far to the right as the furthest there.
std::vector<int> suspects(RowChoice& choice, const SparseMatrix& A,
                          const std::vector<int>& evolving, int point) {
  double furthest = 0;
  std::vector<int> found;
  std::ranges::set_intersection(choice.around(point, block), evolving, std::back_inserter(found));
  for (const int i : found) furthest = std::max(furthest, gershgorin_reach(A, i, i));
  std::vector<int> all;
  for (const int i : evolving)
    if (std::ranges::binary_search(found, i) || gershgorin_reach(A, i, i) >= furthest)
      all.push_back(i);
  return all;
}

/// The points whose values no fixed point reaches by way of the rows; none without a fixed point.
std::vector<int> unreached(const SparseMatrix& A, const std::vector<int>& fixed) {
  if (fixed.empty()) return {};
  const SparseMatrix from = A.transpose();  // row j: the rows that have an entry for j
  std::vector<char> reached(A.rows(), false);
  std::vector<int> front = fixed, result;
  for (const int i : fixed) reached[i] = true;
  while (!front.empty()) {
    const int j = front.back();
    front.pop_back();
    for (SparseMatrix::InnerIterator entry(from, j); entry; ++entry)
      if (const auto i = entry.col(); !reached[i] && entry.value() != 0) {
        reached[i] = true;
        front.push_back(static_cast<int>(i));
      }
  }
  for (int i = 0; i < std::ssize(reached); ++i)
    if (!reached[i]) result.push_back(i);
  return result;
}

/// Whether all entries of row i are of points on one side of its own, as far as some directions can tell: it knows
/// nothing of what the other side holds.
template <int D>
bool one_sided(const Cloud& cloud, const SparseMatrix& A, int i) {
  const Eigen::MatrixXd& axes = directions(D).axes;
  Eigen::VectorXd least = Eigen::VectorXd::Zero(axes.rows()), most = least;
  for (SparseMatrix::InnerIterator entry(A, i); entry; ++entry) {
    const auto j = static_cast<int>(entry.col());
    if (j == i || entry.value() == 0) continue;
    const Eigen::VectorXd along = axes * displacement<D>(cloud, i, j);
    least = least.cwiseMin(along);
    most = most.cwiseMax(along);
  }
  return least.maxCoeff() >= 0 || most.minCoeff() <= 0;
}

/// Those of the points whose rows are one-sided. Rows without a negative weight are not.
std::vector<int> one_sided(const Cloud& cloud, const SparseMatrix& A,
                           const std::vector<int>& points) {
  std::vector<int> result;
  for (const int i : points)
    if (gershgorin_reach(A, i, i) > 1e-9 &&
        dispatch(cloud.dimension(), [&](auto d) { return one_sided<d>(cloud, A, i); }))
      result.push_back(i);
  return result;
}

/// What is wrong with the rows as they are; nowhere: nothing.
struct Trouble {
  std::vector<int> points;  // to exchange, ascending
  std::string words;
};

Trouble trouble(RowChoice& choice, const std::vector<int>& evolving,
                const std::vector<int>& fixed) {
  const Cloud& cloud = choice.cloud();
  const Operator op = choice.rows().operator_of(choice.volumes());
  const auto at = [&](int point) {
    return "at point " + std::to_string(cloud.number(point)) + " (at " +
           coordinates(cloud.positions(), point) + ")";
  };
  if (const std::vector<int> cut = unreached(op.matrix(), fixed); !cut.empty())
    return {cut, "no fixed value reaches " + std::to_string(cut.size()) +
                     (cut.size() == 1 ? " point, the one " : " points, the first ") +
                     at(cut.front())};
  if (const std::vector<int> rows = one_sided(cloud, op.matrix(), evolving); !rows.empty())
    return {rows, "a row has points on one side only, the one " + at(rows.front())};
  const Forecast growth = forecast(cloud, op.matrix(), evolving, op.volumes);
  if (!growth.grows) return {};
  return {suspects(choice, op.matrix(), evolving, growth.point),
          "solutions grow " + at(growth.point)};
}

}  // namespace

void make_stable(RowChoice& choice, const std::vector<int>& fixed) {
  const Cloud& cloud = choice.cloud();
  std::vector<int> all(cloud.size()), evolving, exchanged;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::set_difference(all, fixed, std::back_inserter(evolving));
  for (;;) {
    const Trouble found = trouble(choice, evolving, fixed);
    if (found.words.empty()) return;
    std::vector<int> points, now;
    std::ranges::set_difference(found.points, exchanged, std::back_inserter(points));
    if (points.empty())
      throw SolverError(
          "with every row that is good enough " + found.words +
          "; where points end they want a condition (a fixed value, a wall), elsewhere a "
          "larger tolerance allows other rows");
    choice.choose_anew(points);
    std::ranges::set_union(exchanged, points, std::back_inserter(now));
    exchanged = std::move(now);
  }
}

}  // namespace gradpsi
