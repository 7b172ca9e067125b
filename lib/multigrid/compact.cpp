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

/// Calls f(j, r^2, (1 - q)^3) for the points within the compact support of point i: -W'/r of the Wendland kernel.
template <int D, class F>
void for_each_near(const Cloud& cloud, const DenseVector& s, const Neighbours& near,
                   const std::vector<char>& left_out, int i, const F& f) {
  for (const int j : near.of(i)) {
    if (left_out[j]) continue;
    const double squared = displacement<D>(cloud, i, j).squaredNorm();
    const double support = support_ratio * std::sqrt(s[i] * s[j]);
    const double least = std::min(support, largest_ratio * std::min(s[i], s[j]));
    if (squared >= least * least) continue;
    const double q = std::sqrt(squared) / support;
    f(j, squared, (1 - q) * (1 - q) * (1 - q));
  }
}

double mean(double a, double b) { return is_jump(a, b) ? 2 * a * b / (a + b) : (a + b) / 2; }

template <int D>
SingleSparseMatrix compact(const Cloud& cloud, const DenseVector& s, const Neighbours& near,
                           const Medium& medium, const std::vector<char>& left_out, double scale,
                           int threads) {
  const int n = cloud.size();
  const DenseVector& omega = cloud.volumes();
  SingleSparseMatrix S(n, n);
  int* const outer = S.outerIndexPtr();
  DenseVector strength(n);
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      double second = 0;
      int count = 1;
      for_each_near<D>(cloud, s, near, left_out, i, [&](int j, double squared, double weight) {
        second += omega[j] * weight * squared;
        ++count;
      });
      strength[i] = second > 0 ? 2 * D * medium.diffusivities[i] / second : 0;
      outer[i + 1] = count;
    }
  });
  for (int i = 0; i < n; ++i) outer[i + 1] += outer[i];
  S.resizeNonZeros(outer[n]);
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      int at = outer[i] + 1;
      double diagonal = scale * medium.masses[i];
      for_each_near<D>(cloud, s, near, left_out, i, [&](int j, double, double weight) {
        const double entry = scale * omega[i] * omega[j] * weight * mean(strength[i], strength[j]);
        diagonal += entry;
        S.innerIndexPtr()[at] = j;
        S.valuePtr()[at++] = static_cast<float>(-entry);
      });
      S.innerIndexPtr()[outer[i]] = i;
      S.valuePtr()[outer[i]] = static_cast<float>(diagonal);
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
