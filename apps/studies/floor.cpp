#include "studies/floor.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <limits>
#include <numbers>

#include "common/columns.hpp"
#include "common/fields.hpp"

namespace gradpsi::apps::floor {

namespace {

constexpr int n = 400, ends = 10;  // points, and those at each end that are not looked at
constexpr double support_ratio = 2.5, centre = 0.3;

Cloud points(double spacing) {
  const Cloud lattice = make_cloud(
      Lattice{.dimension = 1, .points_per_side = n, .upper = n, .jitter = 0.2, .seed = 1});
  return Cloud(centre + spacing * (lattice.positions().array() - n / 2),
               {.volumes = Eigen::VectorXd::Constant(n, spacing)});
}

struct Raw {
  double derivative, condition;
};

/// laplacian-mixed-soc in 1D by the letter of Table II, the moments in lengths: at point i, of u.
Raw raw_second_derivative(const Cloud& cloud, const Neighbours& near, int i,
                          const Eigen::VectorXd& u) {
  Eigen::Matrix2d M = Eigen::Matrix2d::Zero();  // conditions on r and r^2, unknowns C0 and C1
  const auto each = [&](const auto& visit) {
    for (const int j : near.of(i)) {
      const double r = cloud.positions()(j) - cloud.positions()(i);
      const double phi =
          -2 * evaluate(kernels().front(), 1, near.support(i), std::abs(r)).dw_over_r;
      visit(j, r, cloud.volumes()[j] * phi);
    }
  };
  each([&](int, double r, double w) {
    M += w * Eigen::Vector2d(r, r * r) * Eigen::RowVector2d(1, r);
  });
  const Eigen::PartialPivLU<Eigen::Matrix2d> lu(M);
  const Eigen::Vector2d C = lu.solve(Eigen::Vector2d(0, 2));
  Raw result{0, 1 / lu.rcond()};
  each([&](int j, double r, double w) {
    result.derivative += w * (C[0] + C[1] * r) * (u[j] - u[i]);
  });
  return result;
}

Result result(double spacing) {
  const Cloud cloud = points(spacing);
  const auto near = find_neighbours(cloud, support_ratio * spacing);
  const Operator op = assemble("laplacian-mixed-soc", cloud, near);
  const Exact field = exact(cosines(1, std::numbers::pi), cloud.positions());
  const Eigen::VectorXd scaled = op.matrix() * field.u;
  Result r{.spacing = spacing};
  for (int i = ends; i < n - ends; ++i) {
    const Raw raw = raw_second_derivative(cloud, near, i, field.u);
    r.error_scaled = std::max(r.error_scaled, std::abs(scaled[i] - field.laplacian[i]));
    r.error_raw = std::max(r.error_raw, std::abs(raw.derivative - field.laplacian[i]));
    r.condition_scaled = std::max(r.condition_scaled, 1 / op.rows.reciprocal_condition[i]);
    r.condition_raw = std::max(r.condition_raw, raw.condition);
  }
  r.floor =
      std::numeric_limits<double>::epsilon() * field.u.cwiseAbs().maxCoeff() / (spacing * spacing);
  return r;
}

}  // namespace

std::vector<Result> results() {
  std::vector<Result> all;
  for (double spacing = 1e-2; spacing > 0.9e-7; spacing /= std::sqrt(10.0))
    all.push_back(result(spacing));
  return all;
}

std::string csv(const std::vector<Result>& results) {
  return apps::csv({{"spacing", &Result::spacing},
                    {"error_scaled", &Result::error_scaled},
                    {"error_raw", &Result::error_raw},
                    {"condition_scaled", &Result::condition_scaled},
                    {"condition_raw", &Result::condition_raw},
                    {"floor", &Result::floor}},
                   results);
}

std::string table(const std::vector<Result>& results) {
  return "u'' of 1 + cos(pi x), laplacian-mixed-soc in 1D, jitter 0.2, h/dx 2.5, around x = 0.3:"
         "\n\n" +
         text_table({{"spacing", &Result::spacing, {"%.1e", 8}},
                     {"error: moments in units of h", &Result::error_scaled, {"%.1e", 31}},
                     {"in lengths", &Result::error_raw, {"%.1e", 13}},
                     {"condition: units of h", &Result::condition_scaled, {"%.1e", 24}},
                     {"in lengths", &Result::condition_raw, {"%.1e", 13}},
                     {"eps |u| / dx^2", &Result::floor, {"%.1e", 17}}},
                    results);
}

}  // namespace gradpsi::apps::floor
