#include "twin.hpp"

#include <algorithm>
#include <cmath>

#include "dispatch.hpp"
#include "parallel.hpp"
#include "points.hpp"

namespace gradpsi {
namespace {

constexpr double support_ratio = 2;

template <int D>
Eigen::VectorXd row_diffusivities(const SparseMatrix& A, const Cloud& points, int threads) {
  Eigen::VectorXd m = Eigen::VectorXd::Zero(A.rows());
  parallel_chunks(static_cast<int>(A.rows()), 1024, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      for (SparseMatrix::InnerIterator a(A, i); a; ++a)
        m[i] -= a.value() * displacement<D>(points, i, a.col()).squaredNorm() / (2 * D);
  });
  return m;
}

template <int D>
SparseMatrix compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& walls,
                          int threads) {
  const int n = static_cast<int>(A.rows());
  const Eigen::VectorXd& omega = points.volumes();
  // Calls f(j, r^2, weight without its scale) for i's neighbours within the compact support.
  const auto for_each_near = [&](int i, const auto& f) {
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      const int j = static_cast<int>(a.col());
      if (j == i) continue;
      const double h = support_ratio * std::pow(omega[i] * omega[j], 0.5 / D);
      const double squared = displacement<D>(points, i, j).squaredNorm();
      if (squared >= h * h) continue;
      const double q = std::sqrt(squared) / h;
      f(j, squared, omega[j] * (1 - q) * (1 - q) * (1 - q));  // -W'/r of the Wendland kernel
    }
  };

  SparseMatrix twin(n, n);
  int* const outer = twin.outerIndexPtr();
  Eigen::VectorXd scale = row_diffusivities<D>(A, points, threads).cwiseMax(0);
  for (const int i : walls) scale[i] = 0;
  parallel_chunks(n, 1024, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      double own = 0;
      int count = 1;
      for_each_near(i, [&](int, double squared, double weight) {
        own += weight * squared / (2 * D);
        ++count;
      });
      scale[i] = own > 0 ? scale[i] / own : 0;
      outer[i + 1] = count;
    }
  });
  for (int i = 0; i < n; ++i) outer[i + 1] += outer[i];
  twin.resizeNonZeros(outer[n]);
  parallel_chunks(n, 1024, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      int at = outer[i], diagonal = -1;
      double sum = 0;
      const auto put = [&](int column, double value) {
        twin.innerIndexPtr()[at] = column;
        twin.valuePtr()[at++] = value;
      };
      for_each_near(i, [&](int j, double, double weight) {
        if (j > i && diagonal < 0) diagonal = at, put(i, 0);
        const double entry = weight * (scale[i] + scale[j]) / 2;
        sum += entry;
        put(j, -entry);
      });
      if (diagonal < 0) diagonal = at, put(i, 0);
      double row_sum = 0;
      for (SparseMatrix::InnerIterator a(A, i); a; ++a) row_sum += a.value();
      twin.valuePtr()[diagonal] = sum + std::max(row_sum, 0.0);
    }
  });
  return twin;
}

}  // namespace

Eigen::VectorXd row_diffusivities(const SparseMatrix& A, const Cloud& points, int threads) {
  return dispatch(points.dimension(), [&](auto d) {
    return row_diffusivities<decltype(d)::value>(A, points, threads);
  });
}

SparseMatrix compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& walls,
                          int threads) {
  return dispatch(points.dimension(), [&](auto d) {
    return compact_twin<decltype(d)::value>(A, points, walls, threads);
  });
}

}  // namespace gradpsi
