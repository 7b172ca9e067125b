#include "dissection.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace gradpsi {
namespace {

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
    constexpr std::size_t leaf = 32;
    if (points.size() <= leaf) return std::sort(points.begin(), points.end(), before_along_a);
    const std::size_t half = points.size() / 2;
    std::nth_element(points.begin(), points.begin() + half, points.end(), before_along_a);
    const double cut = x_(points[half], a);

    ++cuts_;
    for (const int j : points.subspan(half)) behind_[j] = cuts_;
    const auto separator = std::partition(points.begin(), points.begin() + half, [&](int i) {
      return x_(i, a) < cut - reach_[a] || !has_neighbour_behind(i);
    });
    const std::size_t before = separator - points.begin();
    std::rotate(separator, points.begin() + half, points.end());
    order(points.first(before));
    order(points.subspan(before, points.size() - half));
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

}  // namespace gradpsi
