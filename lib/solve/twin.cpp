#include "solve/twin.hpp"

#include <algorithm>
#include <cmath>

#include "base/dispatch.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"
#include "multigrid/medium.hpp"
#include "solve/for_petsc.hpp"

namespace gradpsi {
namespace {

constexpr double support_ratio = 2;

/// Calls f(j, r^2, weight without its scale) for the columns within the compact support of row k's point.
template <int D, class F>
void for_each_near(const SparseMatrix& A, const Cloud& points, int k, int i, const F& f) {
  const DenseVector& omega = points.volumes();
  for (SparseMatrix::InnerIterator a(A, k); a; ++a) {
    const int j = static_cast<int>(a.col());
    if (j == i) continue;
    const double h = support_ratio * std::pow(omega[i] * omega[j], 0.5 / D);
    const double squared = displacement<D>(points, i, j).squaredNorm();
    if (squared >= h * h) continue;
    const double q = std::sqrt(squared) / h;
    f(j, squared, omega[j] * (1 - q) * (1 - q) * (1 - q));  // -W'/r of the Wendland kernel
  }
}

template <int D>
DenseVector twin_scales(const SparseMatrix& A, const Cloud& points,
                        const std::vector<int>& diagonal, const std::vector<int>& walls,
                        int threads) {
  DenseVector scale = row_diffusivities(A, points, diagonal, threads).cwiseMax(0);
  for (const int k : walls) scale[k] = 0;
  parallel_chunks(static_cast<int>(A.rows()), 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double own = 0;
      for_each_near<D>(A, points, k, diagonal[k], [&](int, double squared, double weight) {
        own += weight * squared / (2 * D);
      });
      scale[k] = own > 0 ? scale[k] / own : 0;
    }
  });
  return scale;
}

template <int D>
void compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& places,
                  const VectorView& scale, int threads, SparseMatrix& twin) {
  const int n = static_cast<int>(A.rows());
  twin.resize(n, A.cols());
  int* const outer = twin.outerIndexPtr();
  parallel_chunks(n, 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      int count = 1;
      for_each_near<D>(A, points, k, places[k], [&](int, double, double) { ++count; });
      outer[k + 1] = count;
    }
  });
  for (int k = 0; k < n; ++k) outer[k + 1] += outer[k];
  resize_in_large_pages(twin, outer[n]);
  parallel_chunks(n, 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = places[k];
      int at = outer[k], diagonal = -1;
      double sum = 0;
      const auto put = [&](int column, double value) {
        twin.innerIndexPtr()[at] = column;
        twin.valuePtr()[at++] = value;
      };
      for_each_near<D>(A, points, k, i, [&](int j, double, double weight) {
        if (j > i && diagonal < 0) diagonal = at, put(i, 0);
        const double entry = weight * (scale[i] + scale[j]) / 2;
        sum += entry;
        put(j, -entry);
      });
      if (diagonal < 0) diagonal = at, put(i, 0);
      double row_sum = 0;
      for (SparseMatrix::InnerIterator a(A, k); a; ++a) row_sum += a.value();
      twin.valuePtr()[diagonal] = sum + std::max(row_sum, 0.0);
    }
  });
}

}  // namespace

DenseVector twin_scales(const SparseMatrix& A, const Cloud& points,
                        const std::vector<int>& diagonal, const std::vector<int>& walls,
                        int threads) {
  return dispatch(points.dimension(), [&](auto d) {
    return twin_scales<decltype(d)::value>(A, points, diagonal, walls, threads);
  });
}

void compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                  const VectorView& scales, int threads, SparseMatrix& twin) {
  dispatch(points.dimension(), [&](auto d) {
    compact_twin<decltype(d)::value>(A, points, diagonal, scales, threads, twin);
  });
}

}  // namespace gradpsi
