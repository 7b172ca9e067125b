#include "studies/candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>

namespace gradpsi::apps::candidates {

namespace {

constexpr double pi = std::numbers::pi;
constexpr std::array support_ratios = {2.0, 2.5, 3.0, 3.5, 4.5};

/// Unit vectors along the axes and the diagonals.
std::vector<Eigen::VectorXd> directions(int d) {
  std::vector<Eigen::VectorXd> all;
  for (int a = 0; a < d; ++a) all.push_back(Eigen::VectorXd::Unit(d, a));
  for (int signs = 0; d > 1 && signs < 1 << (d - 1); ++signs) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(d, 1 / std::sqrt(d));
    for (int a = 1; a < d; ++a)
      if (signs >> (a - 1) & 1) diagonal[a] *= -1;
    all.push_back(diagonal);
  }
  return all;
}

/// The wave vector nearest to k that is periodic in the cloud's box.
Eigen::VectorXd fitted(Eigen::VectorXd k, const Cloud& cloud) {
  for (int a = 0; a < cloud.dimension(); ++a)
    if (const double length = cloud.box()[a]; length > 0)
      k[a] = std::nearbyint(k[a] * length / (2 * pi)) * 2 * pi / length;
  return k;
}

double cost(const Candidate& c, Use use) {
  switch (use) {
    case Use::Derivative: return c.assemble + c.product;
    case Use::Explicit: return c.entries / c.step;
    case Use::Implicit: return c.entries;
  }
  return 0;
}

/// Errors, rows and step from the operator's rows of these points, `place[k]` being where points[k] is.
void set_findings(const Trial& trial, const Operator& op, const std::vector<int>& points,
                  const std::vector<int>& place, Candidate& c) {
  Eigen::VectorXd squared = Eigen::VectorXd::Zero(std::ssize(points));
  for (std::size_t a = 0; a < op.axes.size(); ++a) {
    const Eigen::MatrixXd found = op.axes[a] * trial.waves.u;
    squared += (found(place, Eigen::all) - trial.waves.derivatives[a](points, Eigen::all))
                   .rowwise()
                   .squaredNorm();
  }
  squared /= static_cast<double>(trial.waves.u.cols());
  c.error = std::sqrt(squared.mean()) / trial.waves.scale;
  c.worst = std::sqrt(squared.maxCoeff()) / trial.waves.scale;
  c.zero = c.widened = 0;
  double largest = 0;
  for (const int k : place) {
    c.zero += op.rows.outcome[k] == RowOutcome::Zero;
    c.widened += op.rows.outcome[k] == RowOutcome::Widened;
    largest = std::max(largest, op.matrix().row(k).cwiseAbs().sum());
  }
  c.step = 2 / largest;
}

Candidate measured(const Trial& trial, const Scheme& scheme, double support_ratio,
                   const Neighbours& near, double search_seconds, const std::vector<int>& points,
                   Timer& timer) {
  Candidate c{scheme, support_ratio};
  AssemblyOptions options = trial.assembly;
  options.rows = points;
  const auto count = static_cast<double>(points.size());
  Operator op;
  const double weights =
      timer.seconds([&] { op = assemble(scheme, trial.cloud, near, options); }, 0) / count;
  c.assemble = search_seconds / trial.cloud.size() + weights;
  c.entries = static_cast<double>(op.matrix().nonZeros()) / count;
  Eigen::MatrixXd y;
  const Eigen::VectorXd u = trial.waves.u.col(0);
  c.product = timer.seconds([&] { multiply(op.axes, u, y, options.threads); }, 1e-3) / count;
  std::vector<int> place(points.size());
  std::iota(place.begin(), place.end(), 0);
  set_findings(trial, op, points, place, c);
  c.cost = cost(c, trial.use);
  return c;
}

/// Looks at all rows, once: what a sample says may just miss the truth.
void look_at(const Trial& trial, Candidate& c) {
  if (std::exchange(c.looked_at, true)) return;
  const auto near =
      find_neighbours(trial.cloud, trial.supports_of(c.support_ratio), trial.assembly.threads);
  const Operator op = assemble(c.scheme, trial.cloud, near, trial.assembly);
  set_findings(trial, op, trial.evolving, trial.evolving, c);
  if (trial.use != Use::Derivative)
    c.grows = forecast(trial.cloud, op.matrix(), trial.evolving, op.volumes).grows;
}

/// Whether it is complete, and stable where it has to be.
bool suits(const Trial& trial, Candidate& c) {
  if (!c.complete()) return false;
  look_at(trial, c);
  return c.complete() && !c.grows;
}

}  // namespace

Waves waves(const Cloud& cloud, double wavelength, Derivative derivative) {
  const int d = cloud.dimension();
  const bool laplacian = derivative == Derivative::Laplacian;
  const auto along = directions(d);
  const auto count = 2 * std::ssize(along);
  Waves waves{Eigen::MatrixXd(cloud.size(), count), {}, 0};
  waves.derivatives.assign(laplacian ? 1 : d, Eigen::MatrixXd(cloud.size(), count));
  for (Eigen::Index w = 0; w < count; ++w) {
    const Eigen::VectorXd k = fitted(2 * pi / wavelength * along[w / 2], cloud);
    const Eigen::ArrayXd phase = (cloud.positions() * k).array() + (w % 2 == 0 ? 0 : pi / 2);
    waves.u.col(w) = phase.sin();
    if (laplacian)
      waves.derivatives[0].col(w) = -k.squaredNorm() * phase.sin();
    else
      for (int a = 0; a < d; ++a) waves.derivatives[a].col(w) = k[a] * phase.cos();
    waves.scale += (laplacian ? std::pow(k.squaredNorm(), 2) : k.squaredNorm()) / 2;
  }
  waves.scale = std::sqrt(waves.scale / static_cast<double>(count));
  return waves;
}

std::vector<int> sampled(std::vector<int> points, int count) {
  if (count == 0 || count >= std::ssize(points)) return points;
  std::mt19937_64 generator(1);
  for (int k = 0; k < count; ++k)
    std::swap(points[k], points[k + generator() % (points.size() - k)]);
  points.resize(count);
  std::ranges::sort(points);
  return points;
}

std::vector<Candidate> candidates(const Trial& trial, const std::vector<int>& points,
                                  Timer& timer) {
  std::vector<Candidate> all;
  std::vector<double> ratios(support_ratios.begin(), support_ratios.end());
  if (trial.supports.size() > 0) ratios = {std::numeric_limits<double>::quiet_NaN()};
  for (const double ratio : ratios) {
    Neighbours near;
    const Eigen::VectorXd supports = trial.supports_of(ratio);
    const double search = timer.seconds(
        [&] { near = find_neighbours(trial.cloud, supports, trial.assembly.threads); }, 0);
    for (const Scheme& scheme : schemes())
      if (scheme.derivative == trial.derivative &&
          (trial.cloud.dimension() < 3 || degree(scheme) <= 4))
        all.push_back(measured(trial, scheme, ratio, near, search, points, timer));
  }
  std::ranges::stable_sort(all, {}, &Candidate::cost);
  return all;
}

Candidate* cheapest(const Trial& trial, std::vector<Candidate>& by_cost) {
  for (Candidate& c : by_cost)
    if (c.error <= trial.tolerance && suits(trial, c) && c.error <= trial.tolerance) return &c;
  return nullptr;
}

Candidate* most_accurate(const Trial& trial, std::vector<Candidate>& all) {
  std::vector<Candidate*> by_error;
  for (Candidate& c : all) by_error.push_back(&c);
  std::ranges::sort(by_error, {}, [](const Candidate* c) { return c->error; });
  const auto found = std::ranges::find_if(by_error, [&](Candidate* c) { return suits(trial, *c); });
  return found == by_error.end() ? nullptr : *found;
}

int order(const Scheme& scheme) { return degree(scheme) + 1 - gradpsi::order(scheme.derivative); }

std::optional<Spacing> sufficient_spacing(const Trial& trial, std::vector<Candidate>& all) {
  Spacing coarsest{0, nullptr};
  for (Candidate& c : all) {
    // An order can be counted on where waves are resolved, and not over many powers of ten.
    if (order(c.scheme) < 1 || !suits(trial, c) || c.error > 0.5) continue;
    const double spacing =
        trial.spacing * std::pow(trial.tolerance / c.error, 1.0 / order(c.scheme));
    if (spacing > coarsest.spacing) coarsest = {spacing, &c};
  }
  if (!coarsest.candidate || coarsest.spacing < 0.01 * trial.spacing) return std::nullopt;
  return coarsest;
}

}  // namespace gradpsi::apps::candidates
