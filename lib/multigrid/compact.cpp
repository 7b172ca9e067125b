#include "multigrid/compact.hpp"

#include <algorithm>
#include <cmath>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 1024;
constexpr double support_ratio = 2,
                 largest_ratio = 2.4;  // spacings, of both points and of the smaller

double mean(double a, double b) { return is_jump(a, b) ? 2 * a * b / (a + b) : (a + b) / 2; }

/// What the points near others are weighed by, in the order of their lists: (1 - q)^3, -W'/r of the Wendland kernel,
/// within a compact support, else 0.
struct Weights {
  std::vector<float> of;
  std::vector<int> count;  // of those that are not 0, for each point
  DenseVector second;      // sum_j omega_j weight r^2
};

template <int D>
Weights weights(const Cloud& cloud, const DenseVector& s, const Neighbours& near,
                const std::vector<char>& left_out, int threads) {
  const int n = cloud.size();
  const double* const omega = cloud.volumes().data();
  const DenseVector inverse =
      (support_ratio * s.array()).rsqrt();  // of two points: 1 / their support
  Weights result{std::vector<float>(near.indices.size()), std::vector<int>(n), DenseVector(n)};
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      double second = 0;
      int count = 0;
      float* weight = result.of.data() + near.offsets[i];
      for (const int j : near.of(i)) {
        const double squared = squared_distance<D>(cloud, i, j);
        const double q = std::sqrt(squared) * inverse[i] * inverse[j];
        const double largest = largest_ratio * std::min(s[i], s[j]);
        // No branch, which could not be foretold.
        const double rest = 0.5 * (1 - q + std::abs(1 - q)) *
                            static_cast<double>((squared < largest * largest) & !left_out[j]);
        *weight = static_cast<float>(rest * rest * rest);
        second += omega[j] * *weight * squared;
        count += *weight++ > 0;
      }
      result.second[i] = second;
      result.count[i] = count;
    }
  });
  return result;
}

template <int D>
SingleSparseMatrix compact(const Cloud& cloud, const DenseVector& s, const Neighbours& near,
                           const Medium& medium, const std::vector<char>& left_out, double scale,
                           int threads) {
  const int n = cloud.size();
  const DenseVector& omega = cloud.volumes();
  const Weights weights = gradpsi::weights<D>(cloud, s, near, left_out, threads);
  const DenseVector strength =
      (weights.second.array() > 0)
          .select(2 * D * medium.diffusivities.array() / weights.second.array(), 0);
  SingleSparseMatrix S(n, n);
  int* const outer = S.outerIndexPtr();
  for (int i = 0; i < n; ++i) outer[i + 1] = outer[i] + 1 + weights.count[i];
  S.resizeNonZeros(outer[n]);
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    std::vector<int> columns;
    std::vector<float> values;
    for (int i = begin; i < end; ++i) {
      const int some = near.count(i), first = outer[i];
      columns.resize(some + 1);
      values.resize(some + 1);
      int count = 0;
      double diagonal = scale * medium.masses[i];
      const float* weight = weights.of.data() + near.offsets[i];
      for (const int j : near.of(i)) {
        const double entry = scale * omega[i] * omega[j] * *weight * mean(strength[i], strength[j]);
        diagonal += entry;
        columns[count] = j;
        values[count] = static_cast<float>(-entry);
        count += *weight++ > 0;
      }
      S.innerIndexPtr()[first] = i;
      S.valuePtr()[first] = static_cast<float>(diagonal);
      std::copy_n(columns.begin(), count, S.innerIndexPtr() + first + 1);
      std::copy_n(values.begin(), count, S.valuePtr() + first + 1);
    }
  });
  return S;
}

}  // namespace

SingleSparseMatrix compact_matrix(const Cloud& cloud, const DenseVector& spacings,
                                  const Neighbours& near, const Medium& medium,
                                  const std::vector<char>& left_out, double scale, int threads) {
  return dispatch(cloud.dimension(), [&](auto d) {
    return compact<decltype(d)::value>(cloud, spacings, near, medium, left_out, scale, threads);
  });
}

}  // namespace gradpsi
