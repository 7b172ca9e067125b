#include "solve/ordering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "base/stopwatch.hpp"

namespace gradpsi {
namespace {

constexpr std::array<std::pair<Ordering, std::string_view>, 3> names = {
    {{Ordering::Coordinates, "nested dissection by coordinates"},
     {Ordering::Amd, "AMD"},
     {Ordering::Metis, "METIS"}}};

class Dissection {
 public:
  Dissection(const Positions& x, const SparseMatrix& A) : x_(x), A_(A), behind_(x.rows(), 0) {
    reach_ = Eigen::VectorXd::Zero(x.cols());
    for (int i = 0; i < A.rows(); ++i)
      for (SparseMatrix::InnerIterator a(A, i); a; ++a)
        reach_ = reach_.cwiseMax((x.row(i) - x.row(a.col())).cwiseAbs().transpose());
  }

  /// Brings these points into their order of elimination.
  void order(std::span<int> points) {
    if (points.empty()) return;
    const int a = longest_side(points);
    const auto before_along_a = [&](int i, int j) { return x_(i, a) < x_(j, a); };
    constexpr std::size_t leaf = 64;
    if (points.size() <= leaf) return std::sort(points.begin(), points.end(), before_along_a);
    // The separator is taken from before the cut: a cut that much later leaves equal halves. Points
    // often come in layers, and a cut through one needs half a layer more than one between two: of
    // several cuts within a layer the one with the smallest separator is taken.
    const std::size_t half = points.size() / 2;
    const std::size_t centred = half + (half - separate(points, half, a)) / 2;
    const auto layer = static_cast<std::size_t>(
        std::pow(static_cast<double>(points.size()), 1 - 1.0 / static_cast<double>(x_.cols())));
    std::size_t cut = half, smallest = points.size();
    constexpr std::size_t trials = 4;
    for (std::size_t k = 0; k < trials; ++k) {
      const std::size_t trial = std::min(centred + k * layer / trials, points.size() - 1);
      const std::size_t size = trial - separate(points, trial, a);
      if (size < smallest) smallest = size, cut = trial;
    }
    const std::size_t before = separate(points, cut, a);
    std::rotate(points.begin() + before, points.begin() + cut, points.end());
    order(points.first(before));
    order(points.subspan(before, points.size() - cut));
  }

 private:
  int longest_side(std::span<const int> points) const {
    Eigen::RowVectorXd lower = x_.row(points[0]), upper = lower;
    for (const int i : points) {
      lower = lower.cwiseMin(x_.row(i));
      upper = upper.cwiseMax(x_.row(i));
    }
    int longest;
    (upper - lower).maxCoeff(&longest);
    return longest;
  }

  /// Cuts the points after the first `cut` along axis a, and of those brings the ones that separate
  /// to the end; how many do not.
  std::size_t separate(std::span<int> points, std::size_t cut, int a) {
    std::nth_element(points.begin(), points.begin() + cut, points.end(),
                     [&](int i, int j) { return x_(i, a) < x_(j, a); });
    const double at = x_(points[cut], a);
    ++cuts_;
    for (const int j : points.subspan(cut)) behind_[j] = cuts_;
    const auto separator = std::partition(points.begin(), points.begin() + cut, [&](int i) {
      return x_(i, a) < at - reach_[a] || !has_neighbour_behind(i);
    });
    return separator - points.begin();
  }

  bool has_neighbour_behind(int i) const {
    for (SparseMatrix::InnerIterator a(A_, i); a; ++a)
      if (behind_[a.col()] == cuts_) return true;
    return false;
  }

  const Positions& x_;
  const SparseMatrix& A_;
  Eigen::VectorXd reach_;    // the largest distance between neighbours in each direction
  std::vector<int> behind_;  // the last cut that a point was behind
  int cuts_ = 0;
};

}  // namespace

Eigen::VectorXi dissection(const Positions& x, const SparseMatrix& A) {
  Eigen::VectorXi points = Eigen::VectorXi::LinSpaced(x.rows(), 0, static_cast<int>(x.rows()) - 1);
  Dissection(x, A).order({points.data(), static_cast<std::size_t>(points.size())});
  return points;
}

Elimination elimination(const LinearSystem& system, const SparseMatrix& matrix) {
  const Ordering ordering = system.options.ordering;
  if (ordering != Ordering::Coordinates) return {ordering};
  if (!system.has_points()) return {Ordering::Amd};
  Stopwatch watch;
  Elimination result{Ordering::Coordinates, dissection(system.points.cloud.positions(), matrix)};
  result.seconds = watch.lap();
  return result;
}

std::string_view name(Ordering ordering) {
  return std::ranges::find(names, ordering, &std::pair<Ordering, std::string_view>::first)->second;
}

}  // namespace gradpsi
