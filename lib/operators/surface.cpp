#include "operators/surface.hpp"

#include <algorithm>

#include "cloud/geometry.hpp"
#include "gradpsi/operator.hpp"
#include "operators/moments.hpp"

namespace gradpsi {

int surface_outputs(const Equations& equations) {
  return equations.order == 1 ? 3 : equations.outputs;
}

int surface_unknowns(int degree) { return monomials_to(2, std::max(2, degree)); }

void SurfaceRow::gather(const Cloud& cloud, std::span<const int> neighbours, double support,
                        const DenseVector& volumes, int i) {
  n_ = static_cast<int>(neighbours.size());
  h_ = support;
  degree_ = 0;
  normal_.setZero();
  Columns r = this->r(), area = this->area();
  for (int k = 0; k < n_; ++k) {
    r.row(k) = displacement<3>(cloud, i, neighbours[k]) / h_;
    area(k) = volumes[neighbours[k]];
  }
  own_area_ = volumes[i];
}

/// omega_j W of neighbours at s (n x 1 to 3), up to a factor.
template <class Offsets>
void SurfaceRow::weigh(const Offsets& s) {
  Columns weight = this->weight();
  for (int k = 0; k < n_; ++k)
    weight(k) = area()(k) * kernel_.profile(std::min(s.row(k).norm(), 1.0)).w;
  weight /= weight.maxCoeff();
}

/// About the direction in which the neighbours extend least, which the adjugate of their second moments
/// stretches most; 0 if they are on a line.
Direction SurfaceRow::flattest() {
  const auto r = this->r().matrix();
  weigh(r);
  const Eigen::Matrix3d M = r.transpose() * weight().col(0).matrix().asDiagonal() * r;
  Eigen::Matrix3d adjugate;
  for (int a = 0; a < 3; ++a) adjugate.col(a) = M.col((a + 1) % 3).cross(M.col((a + 2) % 3));
  const Eigen::Matrix3d stretch = adjugate * adjugate;
  Eigen::Index longest;
  stretch.diagonal().maxCoeff(&longest);
  return stretch.col(longest).normalized();
}

/// The slope at the point of the polynomial through it that fits the heights over the plane best; nothing
/// if they are too few or it leaves too much.
std::optional<Eigen::Vector2d> SurfaceRow::slope(const Direction& normal, const Axes& axes,
                                                 int degree) {
  const int m = surface_unknowns(degree);
  if (n_ < m) return std::nullopt;
  const Eigen::VectorXd height = r().matrix() * normal;
  const Columns s = plane_.columns(n_, 2), p = monomials_.columns(n_, m);
  Columns(s).matrix().noalias() = r().matrix() * axes;
  weigh(s.matrix());
  fill_monomials<2>(s, p);
  const Eigen::MatrixXd M = moments(weight(), p, p, weighted_.columns(n_, m));
  const Eigen::VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const Inverse inverse = invert_definite(scale.asDiagonal() * M * scale.asDiagonal());
  if (!(inverse.reciprocal_condition >= singular_below)) return std::nullopt;
  const auto w = weight().col(0);
  const Eigen::VectorXd wanted = p.matrix().transpose() * (w * height.array()).matrix();
  const Eigen::VectorXd c = scale.asDiagonal() * (inverse.matrix * (scale.asDiagonal() * wanted));
  const double left = (w * (height - p.matrix() * c).array().square()).sum() / w.sum();
  if (!(left <= rough_above)) return std::nullopt;
  return c.head<2>();
}

/// Finds the plane that touches a polynomial of that degree.
bool SurfaceRow::touch(int degree) {
  if (degree == degree_) return !normal_.isZero();
  degree_ = degree;
  normal_.setZero();
  if (n_ == 0) return false;
  constexpr int most_turns = 20;
  constexpr double level = 1e-13;
  Direction normal = flattest();
  for (int turn = 0; turn < most_turns; ++turn) {
    const Axes axes = tangents(normal);
    const auto slope = this->slope(normal, axes, degree);
    if (!slope) return false;
    normal = (normal - axes * *slope).normalized();
    if (slope->norm() > level) continue;
    normal_ = normal;
    return true;
  }
  return false;
}

Solution SurfaceRow::solve(const Equations& equations) {
  outputs_ = surface_outputs(equations);
  if (!touch(std::max(2, equations.exact))) return {};
  axes_ = tangents(normal_);
  const Columns s = plane_.columns(n_, 2);
  Columns(s).matrix().noalias() = r().matrix() * axes_;
  row_.gather(h_, s, area(), own_area_);
  return row_.solve(equations);
}

void SurfaceRow::write(std::span<const int> neighbours, int i, int output, double* entry) {
  const auto entries = neighbours.size() + 1;
  if (normal_.isZero()) {
    std::fill_n(entry, entries, 0.0);
  } else if (outputs_ == 1) {
    row_.write(neighbours, i, 0, entry);
  } else {
    Columns along = entries_.columns(static_cast<int>(entries), 2);
    for (int a = 0; a < 2; ++a) row_.write(neighbours, i, a, along.col(a).data());
    Eigen::Map<Eigen::ArrayXd>(entry, entries) =
        axes_(output, 0) * along.col(0) + axes_(output, 1) * along.col(1);
  }
}

}  // namespace gradpsi
