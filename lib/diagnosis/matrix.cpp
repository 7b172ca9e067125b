#include "diagnosis/matrix.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/median.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/spectrum.hpp"
#include "matrix/checks.hpp"

namespace gradpsi {

double median_diagonal(const VectorView& diagonal) {
  DenseVector sizes = diagonal.cwiseAbs();
  const auto end = std::remove(sizes.begin(), sizes.end(), 0.0);
  if (end == sizes.begin()) return 0;
  return median(sizes.head(end - sizes.begin()));
}

MatrixSummary summarise(const SparseMatrix& laplacian, const VectorView& volumes) {
  const int n = static_cast<int>(laplacian.rows());
  if (laplacian.cols() != n || volumes.size() != n)
    throw InvalidInput("a matrix of " + std::to_string(n) + " rows, " +
                       std::to_string(laplacian.cols()) + " columns and " +
                       std::to_string(volumes.size()) + " volumes");
  MatrixSummary result{.symmetric = is_symmetric(laplacian, volumes),
                       .dominant = is_dominant(-laplacian)};
  bool negative = false;
  for (int i = 0; i < n; ++i) {
    double diagonal = 0, radius = 0;
    for (SparseMatrix::InnerIterator a(laplacian, i); a; ++a) {
      const int j = static_cast<int>(a.col());
      result.bandwidth = std::max(result.bandwidth, std::abs(i - j));
      if (i == j) {
        diagonal = a.value();
      } else {
        radius += std::abs(a.value());
        negative |= a.value() < 0;
      }
    }
    result.leftmost = std::min(result.leftmost, diagonal - radius);
    result.rightmost = std::max(result.rightmost, diagonal + radius);
  }
  result.m_matrix = result.dominant && !negative;
  if (result.m_matrix) result.rightmost = 0;  // but for rounding
  return result;
}

SparseMatrix principal_part(const SparseMatrix& A, const std::vector<int>& points) {
  std::vector<int> place(A.cols(), -1);
  for (int k = 0; k < static_cast<int>(points.size()); ++k) {
    if (points[k] < 0 || points[k] >= std::min(A.rows(), A.cols()) ||
        (k > 0 && points[k] <= points[k - 1]))
      throw InvalidInput("point " + std::to_string(points[k]) + " is not one of " +
                         std::to_string(A.rows()) + ", or not above the one before it");
    place[points[k]] = k;
  }
  const auto m = std::ssize(points);
  Eigen::Index entries = 0;
  for (const int i : points)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) entries += place[a.col()] >= 0;
  SparseMatrix part(m, m);
  part.reserve(entries);
  for (int k = 0; k < m; ++k) {
    part.startVec(k);
    for (SparseMatrix::InnerIterator a(A, points[k]); a; ++a)
      if (place[a.col()] >= 0) part.insertBack(k, place[a.col()]) = a.value();
  }
  part.finalize();
  return part;
}

}  // namespace gradpsi
