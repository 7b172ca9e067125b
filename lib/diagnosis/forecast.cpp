#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "cloud/points.hpp"
#include "diagnosis/eigenvalues.hpp"
#include "diagnosis/matrix.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spectrum.hpp"
#include "matrix/checks.hpp"

namespace gradpsi {
namespace {

/// Row i and, of those it is connected with over a few steps, the nearest ones, `count` in all.
std::vector<int> nearest_in_matrix(const Cloud& cloud, const SparseMatrix& A,
                                   const std::vector<int>& points, int i, int count) {
  std::vector<int> found = {i};
  std::set<int> seen = {i};
  for (std::size_t k = 0; k < found.size() && std::ssize(found) < 3 * count; ++k)
    for (SparseMatrix::InnerIterator a(A, found[k]); a; ++a)
      if (seen.insert(static_cast<int>(a.col())).second) found.push_back(static_cast<int>(a.col()));
  const auto distance = [&](int j) {
    return dispatch(cloud.dimension(), [&](auto d) {
      return displacement<decltype(d)::value>(cloud, points[i], points[j]).norm();
    });
  };
  std::ranges::stable_sort(found, {}, distance);
  found.resize(std::min<std::size_t>(found.size(), count));
  std::ranges::sort(found);
  return found;
}

}  // namespace

Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const VectorView& volumes) {
  if (laplacian.rows() != cloud.size() || laplacian.cols() != cloud.size() ||
      volumes.size() != cloud.size())
    throw InvalidInput("the matrix is not one of all " + std::to_string(cloud.size()) + " points");
  const SparseMatrix A = principal_part(laplacian, points);
  if (is_dominant(-A)) return {.certain = true};

  constexpr int looked_at = 9, block = 30;
  const int n = static_cast<int>(A.rows());
  std::vector<std::pair<double, int>> discs(n);  // minus the right end, row
  for (int i = 0; i < n; ++i) {
    discs[i] = {0, i};
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      discs[i].first -= a.col() == i ? a.value() : std::abs(a.value());
  }
  const auto rows = std::min(n, looked_at);
  std::partial_sort(discs.begin(), discs.begin() + rows, discs.end());
  Forecast result;
  for (int k = 0; k < rows; ++k) {
    const int i = discs[k].second;
    const auto near = nearest_in_matrix(cloud, A, points, i, block);
    const double rate = eigenvalues(principal_part(A, near)).real().maxCoeff();
    if (k == 0 || rate > result.rate) result.rate = rate, result.point = points[i];
  }
  result.grows = result.rate > slow_growth * median_diagonal(A);
  result.certain = result.grows && is_symmetric(A, volumes(points));
  if (!result.grows) result.point = -1;
  return result;
}

}  // namespace gradpsi
