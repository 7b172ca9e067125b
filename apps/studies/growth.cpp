#include "studies/growth.hpp"

#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>

#include "common/columns.hpp"
#include "studies/lattices.hpp"

namespace gradpsi::apps::growth {

namespace {

constexpr double pi = std::numbers::pi;
constexpr int side = 20;
constexpr double spacing_squared = 1.0 / (side * side), support_ratio = 3, duration = 0.05;
constexpr double beyond_doubt = 1e12;  // a field that has grown so far is not followed any more

/// An irregular square whose outermost points are held, and sin(pi x) sin(pi y) there.
struct Scene {
  Cloud cloud = irregular_points(2, side, 1);
  Neighbours near = find_neighbours(cloud, support_ratio / side);
  std::vector<int> inner = inner_points(2, side);
  BoundaryConditions walls;
  Eigen::VectorXd start;
};

Scene make_scene() {
  Scene scene;
  scene.walls.fixed.points = others(scene.cloud.size(), scene.inner);
  scene.start = (pi * scene.cloud.positions().array()).sin().rowwise().prod();
  scene.start(scene.walls.fixed.points).setZero();
  return scene;
}

template <class Step>
History history(const Scheme& scheme, const char* stepper, double dt, Eigen::VectorXd u,
                const Step& step) {
  History found{scheme, stepper, dt, {}, 0};
  const int steps = static_cast<int>(duration / dt);
  for (int n = 0; n <= steps; ++n) {
    const double largest = u.cwiseAbs().maxCoeff();
    if (!(largest < beyond_doubt)) break;
    found.moments.push_back({n * dt, largest});
    step(u);
  }
  found.last = u.cwiseAbs().maxCoeff();
  return found;
}

History by_explicit_steps(const Scene& scene, const Scheme& scheme, const Operator& op, double dt) {
  return history(scheme, "explicit", dt, scene.start, [&](Eigen::VectorXd& u) {
    const Eigen::VectorXd change = dt * (op.matrix() * u);
    for (const int i : scene.inner) u[i] += change[i];
  });
}

History by_implicit_steps(const Scene& scene, const Scheme& scheme, const Operator& op, double dt) {
  ImplicitDiffusion heat(scene.cloud, op, scene.walls, {.time_step = dt});
  return history(scheme, "implicit", dt, scene.start, [&](Eigen::VectorXd& u) { heat.step(u); });
}

/// Where a ray from z = -1 leaves the region in which RK4 does not amplify.
std::complex<double> edge_of_rk4(std::complex<double> along) {
  double reach = 0;
  while (std::abs(growth_factor(Stepper::RungeKutta4, -1.0 + reach * along)) <= 1) reach += 1e-3;
  return -1.0 + reach * along;
}

}  // namespace

Results results() {
  const Scene scene = make_scene();
  Results results;
  double explicit_step = 0;  // that of the cure, which comes first
  for (const Scheme& scheme : {Scheme("laplacian-positive"), Scheme("laplacian-direct-soc")}) {
    const Operator op =
        assemble(scheme, scene.cloud, scene.near, {.on_degenerate = OnDegenerate::Widen});
    const Spectrum all = spectrum(principal_part(op.matrix(), scene.inner));
    for (const auto& lambda : all.values)
      results.eigenvalues.push_back({scheme, lambda * spacing_squared});
    if (explicit_step == 0) explicit_step = 0.9 * largest_stable_step(all, Stepper::Euler);
    results.histories.push_back(by_explicit_steps(scene, scheme, op, explicit_step));
    for (const double multiple : {1.0, 10.0})
      results.histories.push_back(by_implicit_steps(scene, scheme, op, multiple * explicit_step));
  }
  return results;
}

std::string rk4_region_csv() {
  std::vector<std::complex<double>> edge;
  for (int degrees = 0; degrees <= 360; ++degrees)
    edge.push_back(edge_of_rk4(std::polar(1.0, degrees * pi / 180)));
  return csv(
      {{"real", [](auto& z) { return z.real(); }}, {"imag", [](auto& z) { return z.imag(); }}},
      edge);
}

std::string spectra_csv(const Results& results) {
  return csv({{"scheme", [](auto& e) { return name(e.scheme); }},
              {"real", [](auto& e) { return e.value.real(); }},
              {"imag", [](auto& e) { return e.value.imag(); }}},
             results.eigenvalues);
}

std::string history_csv(const Results& results) {
  std::vector<std::pair<const History*, Moment>> rows;
  for (const History& history : results.histories)
    for (const Moment& moment : history.moments) rows.emplace_back(&history, moment);
  return csv({{"scheme", [](auto& row) { return name(row.first->scheme); }},
              {"stepper", [](auto& row) { return row.first->stepper; }},
              {"step", [](auto& row) { return row.first->step; }},
              {"time", [](auto& row) { return row.second.time; }},
              {"largest", [](auto& row) { return row.second.largest; }}},
             rows);
}

std::string summary(const Results& results) {
  std::string out =
      "Diffusion of sin(pi x) sin(pi y) for a time of 0.05, 20 x 20 points, jitter 0.2, walls "
      "held:\n\n";
  for (const History& h : results.histories)
    out += name(h.scheme) + ", " + h.stepper + " steps of " +
           cell(h.step / spacing_squared, "%.2g") + " dx^2: largest value " + cell(h.last, "%.2g") +
           '\n';
  return out;
}

}  // namespace gradpsi::apps::growth
