#include "multigrid/medium.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"
#include "matrix/checks.hpp"
#include "multigrid/for_petsc.hpp"

namespace gradpsi {
namespace {

template <int D>
DenseVector diffusivities(const SparseMatrix& A, const Cloud& points,
                          const std::vector<int>& diagonal, int threads) {
  DenseVector m(A.rows());
  const double* const x = points.positions().data();
  const std::array<double, 3> box = points.box();
  parallel_chunks(static_cast<int>(A.rows()), 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const double* const own = x + std::ptrdiff_t{diagonal[k]} * D;
      double sum = 0;
      for (SparseMatrix::InnerIterator a(A, k); a; ++a)
        sum += a.value() * squared_distance<D>(own, x + a.col() * D, box);
      m[k] = -sum / (2 * D);
    }
  });
  return m;
}

/// Replaces what these rows know by the mean of others among their entries, weighted by these; in turns, as some
/// have only each other.
void replace_by_neighbours(const SparseMatrix& A, std::vector<int> rows, const OtherRows& others,
                           DenseVector& known) {
  DenseVector is_known = DenseVector::Ones(A.rows());
  is_known(rows).setZero();
  const auto anywhere = [&](bool here) { return others.anywhere ? others.anywhere(here) : here; };
  const auto columns = [&](const DenseVector& of_rows) {
    return others.columns ? others.columns(of_rows) : of_rows;
  };
  while (anywhere(!rows.empty())) {
    const DenseVector value = columns(known), counts = columns(is_known);
    std::vector<int> still;
    for (const int i : rows) {
      double sum = 0, weights = 0;
      for (SparseMatrix::InnerIterator a(A, i); a; ++a)
        if (counts[a.col()] != 0) {
          sum += std::abs(a.value()) * value[a.col()];
          weights += std::abs(a.value());
        }
      if (weights > 0)
        known[i] = sum / weights, is_known[i] = 1;
      else
        still.push_back(i);
    }
    const bool moved = anywhere(still.size() < rows.size());
    rows.swap(still);
    if (!moved) break;
  }
  for (const int i : rows) known[i] = std::max(known[i], 0.0);
}

}  // namespace

DenseVector row_diffusivities(const SparseMatrix& A, const Cloud& points,
                              const std::vector<int>& diagonal, int threads) {
  return dispatch(points.dimension(), [&](auto d) {
    return diffusivities<decltype(d)::value>(A, points, diagonal, threads);
  });
}

Medium medium_of(const SparseMatrix& A, const DenseVector& volumes, DenseVector diffusivities,
                 const std::vector<char>& left_out, const OtherRows& others, int threads) {
  const int n = static_cast<int>(A.rows());
  Medium result{std::move(diffusivities), DenseVector::Zero(n)};
  DenseVector sums = DenseVector::Zero(n);
  parallel_chunks(n, 1024, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      if (const RowSum row = row_sum(A, i); !row.vanishes()) sums[i] = std::max(row.sum, 0.0);
  });
  const double usual = others.median ? others.median(sums) : median(sums);
  std::vector<int> ignorant;
  for (int i = 0; i < n; ++i) {
    if (left_out[i]) sums[i] = 0;
    if (left_out[i] || sums[i] > 2 * usual || !(result.diffusivities[i] > 0)) ignorant.push_back(i);
  }
  result.masses = sums.cwiseProduct(volumes);
  replace_by_neighbours(A, std::move(ignorant), others, result.diffusivities);
  return result;
}

void change_masses(const MediumChange& change, const DenseVector& volumes, DenseVector& masses) {
  masses = change.rate * volumes + change.diffusivity * (masses - change.rate_before * volumes);
}

std::optional<MediumChange> change(const Medium& before, const Medium& now, const Cloud& cloud) {
  const int n = cloud.size();
  const DenseVector& volumes = cloud.volumes();
  const DenseVector ratios = now.diffusivities.cwiseQuotient(before.diffusivities);
  const MediumChange result{median(ratios), median(before.masses.cwiseQuotient(volumes)),
                            median(now.masses.cwiseQuotient(volumes))};
  if (!(result.diffusivity > 0) || !std::isfinite(result.diffusivity)) return {};
  constexpr double half = 1.5;
  DenseVector masses = before.masses;
  change_masses(result, volumes, masses);
  int others = 0;
  for (int i = 0; i < n; ++i) {
    const double ratio = ratios[i] / result.diffusivity;
    // As large as what diffuses to a neighbour.
    const double unit = now.diffusivities[i] * std::pow(volumes[i], 1 - 2.0 / cloud.dimension());
    const bool is_alike = ratio < half && half * ratio > 1 &&
                          std::abs(masses[i] - now.masses[i]) < (half - 1) * (now.masses[i] + unit);
    others += !is_alike;
  }
  return others <= n / 100 ? std::optional(result) : std::nullopt;
}

}  // namespace gradpsi
