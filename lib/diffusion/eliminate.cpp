#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gradpsi/error.hpp"
#include "gradpsi/solver.hpp"
#include "gradpsi/system.hpp"

namespace gradpsi {
namespace {

/// Each point's place among some of them, -1 for the others.
std::vector<int> places(const std::vector<int>& points, Eigen::Index n) {
  std::vector<int> place(n, -1);
  for (int k = 0; k < std::ssize(points); ++k) {
    const int i = points[k];
    if (i < 0 || i >= n || std::exchange(place[i], k) >= 0)
      throw InvalidInput("point " + std::to_string(i) + " is not one of " + std::to_string(n) +
                         ", or is there twice");
  }
  return place;
}

using Entries = std::vector<Eigen::Triplet<double>>;

SparseMatrix matrix(const Entries& entries, Eigen::Index rows, Eigen::Index columns) {
  SparseMatrix result(rows, columns);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

/// The columns of C at points that have a place.
SparseMatrix own(const SparseMatrix& C, const std::vector<int>& place) {
  Entries entries;
  for (int row = 0; row < C.rows(); ++row)
    for (SparseMatrix::InnerIterator c(C, row); c; ++c)
      if (place[c.col()] >= 0) entries.emplace_back(row, place[c.col()], c.value());
  return matrix(entries, C.rows(), C.rows());
}

/// The others that are not empty.
std::vector<int> other_columns(const SparseMatrix& C, const std::vector<int>& place) {
  std::vector<char> there(C.cols(), false);
  for (int row = 0; row < C.rows(); ++row)
    for (SparseMatrix::InnerIterator c(C, row); c; ++c) there[c.col()] |= place[c.col()] < 0;
  std::vector<int> result;
  for (int j = 0; j < C.cols(); ++j)
    if (there[j]) result.push_back(j);
  return result;
}

/// n x n: u at all points from u at those that have no place.
SparseMatrix all_values(const SparseMatrix& C, const std::vector<int>& points,
                        const std::vector<int>& place) {
  constexpr std::ptrdiff_t at_once = 64;
  Entries entries;
  for (int i = 0; i < C.cols(); ++i)
    if (place[i] < 0) entries.emplace_back(i, i, 1);
  LinearSolver solver(own(C, place), {.method = Method::Lu});
  const Eigen::SparseMatrix<double> by_column = C;
  const std::vector<int> columns = other_columns(C, place);
  for (std::ptrdiff_t begin = 0; begin < std::ssize(columns); begin += at_once) {
    const auto count = std::min(at_once, std::ssize(columns) - begin);
    Eigen::MatrixXd b(C.rows(), count), x = Eigen::MatrixXd::Zero(C.rows(), count);
    for (std::ptrdiff_t c = 0; c < count; ++c) b.col(c) = -by_column.col(columns[begin + c]);
    solver.solve(b, x);
    for (std::ptrdiff_t c = 0; c < count; ++c)
      for (Eigen::Index k = 0; k < x.rows(); ++k)
        if (std::abs(x(k, c)) > 1e-15)  // what falls off to rounding along a wall is left out
          entries.emplace_back(points[k], columns[begin + c], x(k, c));
  }
  return matrix(entries, C.cols(), C.cols());
}

}  // namespace

SparseMatrix eliminate(const SparseMatrix& A, const std::vector<int>& points,
                       const SparseMatrix& conditions) {
  const auto n = A.rows(), k = std::ssize(points);
  if (A.cols() != n || conditions.rows() != k || conditions.cols() != n)
    throw InvalidInput("a matrix of " + std::to_string(n) + " rows and " +
                       std::to_string(A.cols()) + " columns, " + std::to_string(k) +
                       " points and conditions of " + std::to_string(conditions.rows()) +
                       " rows and " + std::to_string(conditions.cols()) + " columns");
  const std::vector<int> place = places(points, n);
  if (k == 0) return A;
  SparseMatrix result = A * all_values(conditions, points, place);
  result.prune([&](Eigen::Index i, Eigen::Index, double) { return place[i] < 0; });
  return result;
}

}  // namespace gradpsi
