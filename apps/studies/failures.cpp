#include "studies/failures.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "common/study.hpp"

namespace gradpsi::apps {

using gradpsi::Cloud;
using gradpsi::Lattice;
using gradpsi::Operator;
using gradpsi::Scheme;
using std::filesystem::path;

namespace {

constexpr double pi = std::numbers::pi;

/// Largest |cos| between two phases.
double largest_cosine(double from, double to) {
  const bool peak = std::floor(from / pi) != std::floor(to / pi);
  return peak ? 1 : std::max(std::abs(std::cos(from)), std::abs(std::cos(to)));
}

constexpr std::array wave = {2.0, 2.5, 2.5};

/// A wave with different lengths along the axes, sin(2x) cos(2.5y) cos(2.5z). Without supports no bounds.
Field smooth_field(const gradpsi::Positions& x, const Eigen::VectorXd& supports = {}) {
  Field field{(wave[0] * x.col(0).array()).sin(), {}, {}};
  double squared = wave[0] * wave[0];
  for (Eigen::Index a = 1; a < x.cols(); ++a) {
    field.u.array() *= (wave[a] * x.col(a).array()).cos();
    squared += wave[a] * wave[a];
  }
  field.laplacian = -squared * field.u;
  constexpr int most = 5;  // what is needed at second order
  field.bounds = Eigen::MatrixXd::Zero(supports.size(), most + 1);
  for (Eigen::Index i = 0; i < supports.size(); ++i) {
    // Along each axis, derivatives of even and odd order; the partial ones are their products.
    std::array<std::array<double, 2>, 3> even_or_odd = {{{1, 0}, {1, 0}, {1, 0}}};
    for (Eigen::Index a = 0; a < x.cols(); ++a)
      for (const int odd : {0, 1}) {
        const double phase = wave[a] * x(i, a) - (a == 0 ? pi / 2 : 0) + odd * pi / 2;
        const double reach = wave[a] * supports[i];
        even_or_odd[a][odd] = largest_cosine(phase - reach, phase + reach);
      }
    for (int k = 0; k <= most; ++k)
      for (int l = 0; k + l <= most; ++l)
        for (int m = 0; k + l + m <= most; ++m) {
          double product = 1;
          for (const auto& [a, order] : {std::pair(0, k), std::pair(1, l), std::pair(2, m)})
            product *=
                std::pow(wave[a], order) * even_or_odd[a][order % 2] * (a < x.cols() || order == 0);
          const double count = std::tgamma(k + l + m + 1) /
                               (std::tgamma(k + 1) * std::tgamma(l + 1) * std::tgamma(m + 1));
          field.bounds(i, k + l + m) += count * product * product;
        }
  }
  field.bounds = field.bounds.cwiseSqrt();
  return field;
}

Cloud jittered(int dimension, int side, std::uint64_t seed) {
  return make_cloud(
      Lattice{.dimension = dimension, .points_per_side = side, .jitter = 0.2, .seed = seed});
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

std::string short_text(double x) { return cell(x, "%.2g"); }

/// median (least .. most)
std::string spread(const std::vector<double>& values) {
  return short_text(median(values)) + " (" + short_text(std::ranges::min(values)) + " .. " +
         short_text(std::ranges::max(values)) + ")";
}

struct FailingCase {
  int dimension, side;
  double support_ratio;
  Scheme scheme, cure;
};

const std::vector<FailingCase>& cases() {
  static const std::vector<FailingCase> all = {
      {2, 80, 2.5, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"},
      {2, 40, 3.5, "laplacian-diffuse-soc", "laplacian-diffuse-soc-ls"},
      {3, 16, 3.0, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"},
      {3, 10, 2.5, "laplacian-mixed-soc", "laplacian-mixed-soc-ls"}};
  return all;
}

}  // namespace

Field periodic_field(const gradpsi::Positions& x, int most) {
  Field field{(2 * pi * x.array()).cos().rowwise().prod(), {}, Eigen::MatrixXd(1, most + 1)};
  field.laplacian = -4 * pi * pi * static_cast<double>(x.cols()) * field.u;
  // Waves with wave vectors (+-2 pi, ...), averaged.
  const double wave_number = 2 * pi * std::sqrt(static_cast<double>(x.cols()));
  for (int k = 0; k <= most; ++k) field.bounds(0, k) = std::pow(wave_number, k);
  return field;
}

std::vector<int> inner_points(int dimension, int points_per_side) {
  std::vector<int> inner;
  const int n = static_cast<int>(std::lround(std::pow(points_per_side, dimension)));
  for (int i = 0; i < n; ++i) {
    bool outermost = false;
    for (int a = 0, rest = i; a < dimension; ++a, rest /= points_per_side) {
      const int place = rest % points_per_side;
      outermost |= place == 0 || place == points_per_side - 1;
    }
    if (!outermost) inner.push_back(i);
  }
  return inner;
}

std::string failing_cases(const path& folder, bool quick) {
  const int seeds = quick ? 3 : 20;
  std::string csv =
      "scheme,dimension,points,support_ratio,jitter,seed,error_max,worst_condition,"
      "worst_amplification,bound_over_error,rows_above_bound\n";
  std::string out =
      "Second-order Laplacians on jittered squares and cubes (0.2 dx), truncated at the boundary;\n"
      "medians over " +
      std::to_string(seeds) +
      " seeds (least .. most):\n\n"
      "                                                           largest error"
      "               worst condition         bound / error\n";
  for (const FailingCase& c : cases())
    for (const Scheme& scheme : {c.scheme, c.cure}) {
      std::vector<double> errors, conditions, ratios;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Cloud cloud = jittered(c.dimension, c.side, seed);
        const Operator op =
            assemble(scheme, cloud, find_neighbours(cloud, c.support_ratio / c.side),
                     {.on_degenerate = gradpsi::OnDegenerate::Widen});
        const auto rows = diagnose(scheme, cloud, op);
        const Field field = smooth_field(cloud.positions(), op.rows.supports);
        const Eigen::VectorXd error = (op.matrix() * field.u - field.laplacian).cwiseAbs();
        const Eigen::VectorXd bound = error_bound(rows, field.bounds);
        Eigen::Index worst;
        errors.push_back(error.maxCoeff(&worst));
        conditions.push_back(1 / op.rows.reciprocal_condition.minCoeff());
        ratios.push_back(bound[worst] / error[worst]);
        csv += name(scheme) + ',' + std::to_string(c.dimension) + ',' +
               std::to_string(cloud.size()) + ',' + cell(c.support_ratio) + ",0.2," +
               std::to_string(seed) + ',' + cell(errors.back()) + ',' + cell(conditions.back()) +
               ',' + cell(rows.amplification.maxCoeff()) + ',' + cell(ratios.back()) + ',' +
               std::to_string((error.array() > bound.array()).count()) + '\n';
      }
      out += std::to_string(c.dimension) + "D " + padded(std::to_string(c.side), 2) + "^" +
             std::to_string(c.dimension) + ", h/dx " + cell(c.support_ratio, "%.1f") + "  " +
             name(scheme) + padded(spread(errors), 52 - static_cast<int>(name(scheme).size())) +
             padded(spread(conditions), 30) + padded(spread(ratios), 22) + '\n';
    }
  gradpsi::write_text(folder / "failure.csv", csv);
  return out;
}

std::string orders_of_least_squares(const path& folder, bool quick) {
  struct Row {
    int degree;
    double support_ratio;
  };
  std::vector<int> sides = {20, 40, 80};
  if (quick) sides.pop_back();
  std::string csv = "scheme,support_ratio,points,neighbours,error_l2,interior_l2,worst_condition\n";
  std::string out =
      "laplacian-ls-P, jittered square (0.2 dx), L2 error over all points, boundary included:\n\n"
      " P  h/dx  neighbours";
  for (const int side : sides) out += padded(std::to_string(side) + "^2", 10);
  out += "   interior order   worst condition\n";
  for (const auto& [degree, ratio] :
       {Row{2, 2.5}, Row{3, 3.5}, Row{4, 4.5}, Row{5, 5.5}, Row{6, 5.5}}) {
    const Scheme scheme("laplacian-ls-" + std::to_string(degree));
    std::vector<double> errors, interiors;
    double worst = 0, neighbours = 0;
    for (const int side : sides) {
      const Cloud cloud = jittered(2, side, 1);
      const double h = ratio / side;
      const Operator op = assemble(scheme, cloud, find_neighbours(cloud, h),
                                   {.on_degenerate = gradpsi::OnDegenerate::Widen});
      const Field field = smooth_field(cloud.positions());
      const Eigen::ArrayXd error = (op.matrix() * field.u - field.laplacian).array();
      const auto inside = ((cloud.positions().array() > h).rowwise().all() &&
                           (cloud.positions().array() < 1 - h).rowwise().all())
                              .cast<double>()
                              .eval();
      errors.push_back(std::sqrt(error.square().mean()));
      interiors.push_back(std::sqrt((inside * error.square()).sum() / inside.sum()));
      worst = std::max(worst, 1 / op.rows.reciprocal_condition.minCoeff());
      neighbours = op.rows.neighbours.cast<double>().mean();
      csv += name(scheme) + ',' + cell(ratio) + ',' + std::to_string(cloud.size()) + ',' +
             cell(neighbours) + ',' + cell(errors.back()) + ',' + cell(interiors.back()) + ',' +
             cell(1 / op.rows.reciprocal_condition.minCoeff()) + '\n';
    }
    const double order = std::log2(interiors[interiors.size() - 2] / interiors.back());
    out += padded(std::to_string(degree), 2) + padded(cell(ratio, "%.1f"), 6) +
           padded(cell(neighbours, "%.0f"), 12);
    for (const double error : errors) out += padded(cell(error, "%.1e"), 10);
    out += padded(cell(order, "%.1f"), 17) + padded(cell(worst, "%.0e"), 18) + '\n';
  }
  gradpsi::write_text(folder / "orders.csv", csv);
  return out;
}

namespace {

struct Raw {
  double derivative, condition;
};

/// laplacian-mixed-soc in 1D by the letter of Table II, the moments in lengths: at point i, of u.
Raw raw_second_derivative(const Cloud& cloud, const gradpsi::Neighbours& near, int i,
                          const Eigen::VectorXd& u) {
  Eigen::Matrix2d M = Eigen::Matrix2d::Zero();  // conditions on r and r^2, unknowns C0 and C1
  const auto each = [&](const auto& visit) {
    for (const int j : near.of(i)) {
      const double r = cloud.positions()(j) - cloud.positions()(i);
      const double phi =
          -2 * evaluate(gradpsi::kernels().front(), 1, near.support(i), std::abs(r)).dw_over_r;
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

}  // namespace

std::string cancellation_floor(const path& folder) {
  constexpr int n = 400;
  constexpr double ratio = 2.5, start = 0.3;
  const double eps = std::numeric_limits<double>::epsilon();
  std::string csv = "spacing,error_scaled,error_raw,condition_scaled,condition_raw,floor\n";
  std::string out =
      "u'' of 1 + cos(pi x), laplacian-mixed-soc in 1D, jitter 0.2, h/dx 2.5, around x = 0.3:\n\n"
      " spacing   error: moments in units of h   in lengths   condition: units of h   in lengths"
      "   eps |u| / dx^2\n";
  for (double dx = 1e-2; dx > 0.9e-7; dx /= std::sqrt(10.0)) {
    const Cloud lattice = make_cloud(
        Lattice{.dimension = 1, .points_per_side = n, .upper = n, .jitter = 0.2, .seed = 1});
    const Cloud cloud(start + dx * (lattice.positions().array() - n / 2),
                      {.volumes = Eigen::VectorXd::Constant(n, dx)});
    const auto near = find_neighbours(cloud, ratio * dx);
    const Operator op = gradpsi::assemble("laplacian-mixed-soc", cloud, near);
    const Eigen::VectorXd u = 1 + (pi * cloud.positions().array()).cos();
    const Eigen::VectorXd exact = -pi * pi * (u.array() - 1);
    const Eigen::VectorXd scaled = op.matrix() * u;
    double error_scaled = 0, error_raw = 0, condition_scaled = 0, condition_raw = 0;
    for (int i = 10; i < n - 10; ++i) {
      const Raw raw = raw_second_derivative(cloud, near, i, u);
      error_scaled = std::max(error_scaled, std::abs(scaled[i] - exact[i]));
      error_raw = std::max(error_raw, std::abs(raw.derivative - exact[i]));
      condition_scaled = std::max(condition_scaled, 1 / op.rows.reciprocal_condition[i]);
      condition_raw = std::max(condition_raw, raw.condition);
    }
    const double floor = eps * u.cwiseAbs().maxCoeff() / (dx * dx);
    csv += cell(dx);
    for (const double x : {error_scaled, error_raw, condition_scaled, condition_raw, floor})
      csv += ',' + cell(x);
    csv += '\n';
    out += padded(cell(dx, "%.1e"), 8) + padded(cell(error_scaled, "%.1e"), 31) +
           padded(cell(error_raw, "%.1e"), 13) + padded(cell(condition_scaled, "%.1e"), 24) +
           padded(cell(condition_raw, "%.1e"), 13) + padded(cell(floor, "%.1e"), 17) + '\n';
  }
  gradpsi::write_text(folder / "floor.csv", csv);
  return out;
}

namespace {

/// The edge of the region where RK4 does not amplify, by rays from z = -1.
std::string rk4_region() {
  std::string csv = "real,imag\n";
  for (int degrees = 0; degrees <= 360; ++degrees) {
    const auto along = std::polar(1.0, degrees * pi / 180);
    const auto amplifies = [&](double reach) {
      const std::complex<double> z = -1.0 + reach * along;
      return std::abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))) > 1;
    };
    double reach = 0;
    while (!amplifies(reach)) reach += 1e-3;
    csv += cell(-1 + reach * along.real()) + ',' + cell(reach * along.imag()) + '\n';
  }
  return csv;
}

}  // namespace

std::string growth_and_cure(const path& folder) {
  gradpsi::write_text(folder / "rk4_region.csv", rk4_region());
  constexpr int side = 20;
  constexpr double ratio = 3, duration = 0.05;
  const Cloud cloud = jittered(2, side, 1);
  const auto near = find_neighbours(cloud, ratio / side);
  const std::vector<int> inner = inner_points(2, side);
  gradpsi::BoundaryConditions boundary;
  for (int i = 0; i < cloud.size(); ++i)
    if (!std::ranges::binary_search(inner, i)) boundary.fixed.points.push_back(i);
  Eigen::VectorXd start = (pi * cloud.positions().array()).sin().rowwise().prod();
  start(boundary.fixed.points).setZero();

  std::string spectra = "scheme,real,imag\n", history = "scheme,stepper,step,time,largest\n", out;
  const double dx2 = 1.0 / (side * side);
  double explicit_step = 0;  // that of the cure, which comes first
  for (const Scheme& scheme : {Scheme("laplacian-positive"), Scheme("laplacian-direct-soc")}) {
    const Operator op =
        assemble(scheme, cloud, near, {.on_degenerate = gradpsi::OnDegenerate::Widen});
    const auto A = gradpsi::principal_part(op.matrix(), inner);
    const gradpsi::Spectrum all = gradpsi::spectrum(A);
    if (explicit_step == 0) explicit_step = 0.9 * largest_stable_step(all, gradpsi::Stepper::Euler);
    for (const auto& lambda : all.values)
      spectra +=
          name(scheme) + ',' + cell(lambda.real() * dx2) + ',' + cell(lambda.imag() * dx2) + '\n';

    const auto follow = [&](const std::string& stepper, double dt, const auto& step) {
      Eigen::VectorXd u = start;
      const int steps = static_cast<int>(duration / dt);
      for (int n = 0; n <= steps; ++n) {
        const double largest = u.cwiseAbs().maxCoeff();
        if (!(largest < 1e12)) break;
        history += name(scheme) + ',' + stepper + ',' + cell(dt) + ',' + cell(n * dt) + ',' +
                   cell(largest) + '\n';
        step(u);
      }
      out += name(scheme) + ", " + stepper + " steps of " + cell(dt / dx2, "%.2g") +
             " dx^2: largest value " + short_text(u.cwiseAbs().maxCoeff()) + '\n';
    };
    follow("explicit", explicit_step, [&](Eigen::VectorXd& u) {
      const Eigen::VectorXd change = explicit_step * (op.matrix() * u);
      for (const int i : inner) u[i] += change[i];
    });
    for (const double multiple : {1.0, 10.0}) {
      const double dt = multiple * explicit_step;
      gradpsi::ImplicitDiffusion heat(cloud, op, boundary, {.time_step = dt});
      follow("implicit", dt, [&](Eigen::VectorXd& u) { heat.step(u); });
    }
  }
  gradpsi::write_text(folder / "spectra.csv", spectra);
  gradpsi::write_text(folder / "history.csv", history);
  return "Diffusion of sin(pi x) sin(pi y) for a time of 0.05, 20 x 20 points, jitter 0.2, walls "
         "held:\n\n" +
         out;
}

}  // namespace gradpsi::apps
