#include "multigrid/transfer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/dispatch.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"
#include "multigrid/thinning.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 2048;
constexpr double ridge = 1e-3;  // holds linear functions where kept points are on a line
constexpr float least = -0.3f;  // weight of a linear fit, below which the plain ones are better

/// The rows of an interpolation: what `near` lists of kept points, with weights.
template <int D>
class Rows {
 public:
  Rows(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near, double reach,
       const std::vector<int>& place, const Medium& medium)
      : cloud_(cloud),
        spacings_(spacings),
        near_(near),
        reach_(reach),
        place_(place),
        medium_(medium) {}

  /// The number of kept points that the row of point i has.
  int count(int i) const {
    if (place_[i] >= 0) return 1;
    return static_cast<int>(
        std::ranges::count_if(near_.of(i), [this](int j) { return place_[j] >= 0; }));
  }

  /// Writes them and their weights, plain and fitted.
  void fill(int i, int* column, float* plain, float* fitted) {
    if (place_[i] >= 0) {
      *column = place_[i];
      *plain = *fitted = 1;
      return;
    }
    gather(i, column);
    double sum = 0;
    for (const Kept& kept : kept_) sum += kept.weight;
    for (std::size_t k = 0; k < kept_.size(); ++k) {
      kept_[k].weight /= sum;
      plain[k] = fitted[k] = static_cast<float>(kept_[k].weight);
    }
    if (!jump_) fit(plain, fitted);
  }

 private:
  struct Kept {
    Vector<D> r;  // in spacings
    double weight;
  };

  void gather(int i, int* column) {
    kept_.clear();
    jump_ = false;
    const double own = medium_.diffusivities[i], per_reach = 1 / (reach_ * spacings_[i]);
    for (const int j : near_.of(i)) {
      if (place_[j] < 0) continue;
      *column++ = place_[j];
      const double q = std::min(std::sqrt(squared_distance<D>(cloud_, i, j)) * per_reach, 1.0);
      const double other = medium_.diffusivities[j];
      double weight = (1 - q) * (1 - q) / (q * q + 0.01) + 1e-6;
      if (is_jump(own, other)) {
        jump_ = true;
        weight *= own + other > 0 ? 2 * other / (own + other) : 1;
      }
      kept_.push_back({displacement<D>(cloud_, i, j) * (reach_ * per_reach), weight});
    }
  }

  /// Moving least squares of linear functions: the plain weights, whose sum is 1, times a (1 + b . r), such that the
  /// sum remains and, up to the ridge, first moments vanish.
  void fit(const float* plain, float* fitted) const {
    Vector<D> first = Vector<D>::Zero();
    Eigen::Matrix<double, D, D> second = ridge * Eigen::Matrix<double, D, D>::Identity();
    for (const Kept& kept : kept_) {
      first += kept.weight * kept.r;
      second.noalias() += kept.weight * kept.r * kept.r.transpose();
    }
    const Vector<D> b = -(second.inverse() * first);
    const double a = 1 / (1 + b.dot(first));
    bool fits = true;
    for (std::size_t k = 0; k < kept_.size(); ++k) {
      fitted[k] = static_cast<float>(kept_[k].weight * a * (1 + b.dot(kept_[k].r)));
      fits = fits && fitted[k] >= least;
    }
    if (!fits) std::copy_n(plain, kept_.size(), fitted);
  }

  const Cloud& cloud_;
  const DenseVector& spacings_;
  const Neighbours& near_;
  double reach_;                   // of these, in spacings
  const std::vector<int>& place_;  // of kept points among themselves; -1
  const Medium& medium_;
  std::vector<Kept> kept_;
  bool jump_ = false;
};

/// The kept point that each point without one in its list is near, by that point's list; else -1.
std::vector<int> keepers(const Neighbours& near, const std::vector<int>& kept,
                         const std::vector<int>& place, const std::vector<char>& left_out) {
  std::vector<int> result(near.size(), -1);
  for (const int k : kept)
    for (const int i : near.of(k))
      if (place[i] < 0 && !left_out[i]) result[i] = place[k];
  return result;
}

/// The transpose's pattern, and for each of its entries which one of A it is. Rows are parted among threads, each
/// part's entries in a column following those of the part before: the result does not depend on how many there are.
std::vector<int> transposed_pattern(const SingleSparseMatrix& A, int threads,
                                    SingleSparseMatrix& result) {
  const int n = static_cast<int>(A.rows()), m = static_cast<int>(A.cols());
  const int parts = std::clamp(n / rows_per_chunk, 1, checked_threads(threads));
  const auto first_row = [&](int part) { return static_cast<int>(std::int64_t{n} * part / parts); };
  const int* const outer = A.outerIndexPtr();
  std::vector<std::vector<int>> next(parts);  // where each part's next entry of a column goes
  parallel_chunks(parts, 1, threads, [&](int part, int) {
    next[part].assign(m, 0);
    for (int k = outer[first_row(part)]; k < outer[first_row(part + 1)]; ++k)
      ++next[part][A.innerIndexPtr()[k]];
  });
  result.resize(m, n);
  int at = 0;
  for (int j = 0; j < m; ++j) {
    result.outerIndexPtr()[j] = at;
    for (int part = 0; part < parts; ++part) at += std::exchange(next[part][j], at);
  }
  result.outerIndexPtr()[m] = at;
  result.resizeNonZeros(at);
  std::vector<int> entry(at);
  parallel_chunks(parts, 1, threads, [&](int part, int) {
    for (int i = first_row(part); i < first_row(part + 1); ++i)
      for (int k = outer[i]; k < outer[i + 1]; ++k) {
        const int to = next[part][A.innerIndexPtr()[k]]++;
        result.innerIndexPtr()[to] = i;
        entry[to] = k;
      }
  });
  return entry;
}

/// Sets the restriction, and what the kept points stand for, by plain weights, which are positive.
void restrict_to(const std::vector<int>& kept, const std::vector<float>& plain,
                 const DenseVector& volumes, const Medium& fine, int threads, Transfer& result) {
  const auto m = static_cast<int>(kept.size());
  SingleSparseMatrix& R = result.restriction;
  const std::vector<int> entry = transposed_pattern(result.interpolation, threads, R);
  const float* const fitted = result.interpolation.valuePtr();
  for (DenseVector* sums : {&result.volumes, &result.medium.masses, &result.medium.diffusivities})
    sums->setZero(m);
  parallel_chunks(m, rows_per_chunk, threads, [&](int begin, int end) {
    for (int j = begin; j < end; ++j) {
      double alike = 0;  // volumes of the same medium
      for (int k = R.outerIndexPtr()[j]; k < R.outerIndexPtr()[j + 1]; ++k) {
        R.valuePtr()[k] = fitted[entry[k]];
        const int i = R.innerIndexPtr()[k];
        const double weight = plain[entry[k]], diffusivity = fine.diffusivities[i];
        result.volumes[j] += weight * volumes[i];
        result.medium.masses[j] += weight * fine.masses[i];
        if (is_jump(diffusivity, fine.diffusivities[kept[j]])) continue;
        alike += weight * volumes[i];
        result.medium.diffusivities[j] += weight * volumes[i] * diffusivity;
      }
      result.medium.diffusivities[j] /= alike;
    }
  });
}

template <int D>
Transfer transfer(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near,
                  double reach, const std::vector<int>& kept, const std::vector<char>& left_out,
                  const Medium& medium, int threads) {
  const int n = cloud.size();
  std::vector<int> place(n, -1);
  for (std::size_t k = 0; k < kept.size(); ++k) place[kept[k]] = static_cast<int>(k);
  const Rows<D> rows(cloud, spacings, near, reach, place, medium);

  Transfer result;
  SingleSparseMatrix& P = result.interpolation;
  P.resize(n, static_cast<Eigen::Index>(kept.size()));
  int* const outer = P.outerIndexPtr();
  std::atomic<bool> some_have_none = false;
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      outer[i + 1] = left_out[i] ? 0 : rows.count(i);
      if (outer[i + 1] == 0 && !left_out[i]) some_have_none = true;
    }
  });
  std::vector<int> keeper(n, -1);
  if (some_have_none) {
    keeper = keepers(near, kept, place, left_out);
    for (int i = 0; i < n; ++i)
      if (outer[i + 1] == 0 && keeper[i] >= 0) outer[i + 1] = 1;
  }
  for (int i = 0; i < n; ++i) outer[i + 1] += outer[i];
  P.resizeNonZeros(outer[n]);
  std::vector<float> plain(outer[n]);
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    Rows<D> own = rows;
    for (int i = begin; i < end; ++i) {
      const int at = outer[i];
      if (outer[i + 1] == at) continue;
      if (rows.count(i) == 0) {
        P.innerIndexPtr()[at] = keeper[i];
        P.valuePtr()[at] = plain[at] = 1;
      } else {
        own.fill(i, P.innerIndexPtr() + at, plain.data() + at, P.valuePtr() + at);
      }
    }
  });
  restrict_to(kept, plain, cloud.volumes(), medium, threads, result);
  return result;
}

}  // namespace

Transfer transfer(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near,
                  double reach, const std::vector<int>& kept, const std::vector<char>& left_out,
                  const Medium& medium, int threads) {
  return dispatch(cloud.dimension(), [&](auto d) {
    return transfer<decltype(d)::value>(cloud, spacings, near, reach, kept, left_out, medium,
                                        threads);
  });
}

}  // namespace gradpsi
