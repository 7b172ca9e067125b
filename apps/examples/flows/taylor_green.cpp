// The Taylor-Green vortex on points that move with the flow.
//
//     taylor_green [--jitter J] [POINTS_PER_SIDE ...]     (20 40 80, from a lattice jittered by 0.2)
//
// A periodic box of length 1, velocities up to 1, viscosity 0.01: Re 100. From
//
//     u = (sin 2 pi x cos 2 pi y, -cos 2 pi x sin 2 pi y)
//
// points move with the fluid, and their velocity changes by -grad p + nu lap u. The pressure takes what
// divergence there is within a step, and keeps it from coming back:
//
//     lap p = div u / dt - sum_ab d_a u_b d_b u_a
//
// Where the flow stretches, points would line up. So they are shifted, too, with a velocity s down the gradient of
// their concentration sum_j omega_j W_ij; s . grad u carries the values along. Midpoint rule, dt = dx / 4.
//
// Prints a CSV: the relative error of the velocity (2-norm) at t = 0.25 where the points are by then, its
// order from the line before, and what a step takes of search, assembly, pressure and the rest, in times of
// one assembly. Expect order 2 or more, and 4e-4 on 80 x 80 points.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "argument.hpp"

namespace {

using Field = Eigen::VectorXd;
using Vectors = Eigen::MatrixXd;  // n x 2

constexpr double viscosity = 0.01, end = 0.25;

Vectors exact(const Vectors& x, double t) {
  constexpr double k = 2 * std::numbers::pi;
  const Eigen::ArrayXd a = k * x.col(0).array(), b = k * x.col(1).array();
  Vectors u(x.rows(), 2);
  u << sin(a) * cos(b), -cos(a) * sin(b);
  return std::exp(-2 * k * k * viscosity * t) * u;
}

/// Seconds spent on each of the parts of a step.
struct Seconds {
  double search = 0, assembly = 0, pressure = 0, other = 0;
};

/// Adds to one of these what passes while it exists.
class Timer {
 public:
  explicit Timer(double& seconds) : seconds_(seconds) {}
  Timer(const Timer&) = delete;
  ~Timer() { seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  Clock::time_point begin_ = Clock::now();
};

struct Rates {
  Vectors position, velocity;
};

class Flow {
 public:
  Flow(const gradpsi::Cloud& cloud, double dt)
      : cloud_(cloud), dt_(dt), dx_(cloud.spacing()), pressure_(Field::Zero(cloud.size())) {
    search();
  }

  /// How the points and their velocities change when they are at x with velocities u.
  Rates rates(const Vectors& x, const Vectors& u) {
    move_to(x);
    Vectors du;  // d u_x/dx, d u_x/dy, d u_y/dx, d u_y/dy
    {
      Timer timer(seconds.other);
      gradpsi::multiply(gradpsi::VectorOperator::VelocityGradient, gradient().axes, u, du);
    }
    solve_pressure(du);
    Timer timer(seconds.other);
    Vectors force, viscous;
    gradpsi::multiply(gradient().axes, pressure_, force);
    gradpsi::multiply(laplacian().matrix(), u, viscous);
    const Vectors s = shift();
    Rates rates{u + s, viscosity * viscous - force};
    for (int a = 0; a < 2; ++a)
      rates.velocity.col(a) += s.cwiseProduct(du.middleCols(2 * a, 2)).rowwise().sum();
    return rates;
  }

  Seconds seconds;
  int assemblies = 0;

 private:
  const gradpsi::Operator& gradient() const { return operators_[0]; }
  const gradpsi::Operator& laplacian() const { return operators_[1]; }
  const gradpsi::Operator& uncorrected() const { return operators_[2]; }

  void move_to(const Vectors& x) {
    cloud_.move_to(x);
    if (is_stale(near_, cloud_)) return search();
    Timer timer(seconds.assembly);
    reassemble(schemes_, cloud_, near_, operators_);
    ++assemblies;
  }

  void search() {
    {
      Timer timer(seconds.search);
      near_ = find_neighbours(cloud_, 3.5 * dx_, gradpsi::Skin{dx_});
    }
    Timer timer(seconds.assembly);
    operators_ = assemble(schemes_, cloud_, near_);
    ++assemblies;
  }

  /// Nothing holds the pressure but that its mean is 0. Iterations start from the last one, on the coarser points of
  /// steps before.
  void solve_pressure(const Vectors& du) {
    Timer timer(seconds.pressure);
    const auto xx = du.col(0).array(), xy = du.col(1).array(), yx = du.col(2).array(),
               yy = du.col(3).array();
    if (poisson_)
      poisson_->update(cloud_, laplacian());
    else
      poisson_.emplace(cloud_, laplacian(), gradpsi::BoundaryConditions{},
                       gradpsi::SolverOptions{.tolerance = 1e-8});
    const Field f = (xx + yy) / dt_ - xx.square() - 2 * xy * yx - yy.square();
    poisson_->solve(f, pressure_);
  }

  /// -h grad sum_j omega_j W_ij; that gradient's sum is what gradient-direct-zoc subtracts at the point itself.
  Vectors shift() const {
    Vectors s(cloud_.size(), 2);
    for (int a = 0; a < 2; ++a) s.col(a) = 3.5 * dx_ * uncorrected().axes[a].diagonal();
    return s;
  }

  const std::vector<gradpsi::Scheme> schemes_ = {"gradient-ls-2", "laplacian-ls-2",
                                                 "gradient-direct-zoc"};
  gradpsi::Cloud cloud_;
  double dt_, dx_;
  Field pressure_;
  std::optional<gradpsi::Poisson> poisson_;
  gradpsi::Neighbours near_;
  std::vector<gradpsi::Operator> operators_;
};

/// Prints a line, and returns the error.
double run(int side, double jitter, int side_before, double error_before) {
  const gradpsi::Cloud cloud =
      gradpsi::make_cloud({.points_per_side = side, .jitter = jitter, .periodic = true});
  const int steps = side;
  const double dt = end / steps;
  Flow flow(cloud, dt);
  Vectors x = cloud.positions(), u = exact(x, 0);
  for (int n = 0; n < steps; ++n) {
    const Rates now = flow.rates(x, u);
    const Rates midway = flow.rates(x + dt / 2 * now.position, u + dt / 2 * now.velocity);
    x += dt * midway.position;
    u += dt * midway.velocity;
  }
  const double error = (u - exact(x, end)).norm() / exact(x, end).norm();
  std::printf("%d,%d,%.2e,", side, steps, error);
  if (error_before > 0)
    std::printf("%.2f", std::log(error_before / error) / std::log(double(side) / side_before));
  const Seconds& s = flow.seconds;
  const double assembly = s.assembly / flow.assemblies, unit = assembly * steps;
  std::printf(",%.2e,%.2f,%.2f,%.2f,%.2f\n", assembly, s.search / unit, s.assembly / unit,
              s.pressure / unit, s.other / unit);
  std::fflush(stdout);
  return error;
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<int> sides;
  double jitter = 0.2;
  for (int k = 1; k < argc; ++k)
    if (std::string(argv[k]) == "--jitter" && k + 1 < argc)
      jitter = argument("--jitter", argv[++k], 0.0);
    else
      sides.push_back(argument("POINTS_PER_SIDE", argv[k], 9));
  if (sides.empty()) sides = {20, 40, 80};
  std::puts("points_per_side,steps,error,order,assembly_seconds,search,assembly,pressure,other");
  double error = 0;
  for (std::size_t k = 0; k < sides.size(); ++k)
    error = run(sides[k], jitter, k > 0 ? sides[k - 1] : 0, error);
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
