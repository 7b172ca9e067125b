// Pressure on points that move: a CSV of seconds a step, for each number of points.
//
//     gradpsi_moving_benchmark [POINTS ..] [--threads N]     (6400 100000, one thread)
//
// 100 steps of a Taylor-Green vortex in a periodic box, dt = dx/4, points shifted down the gradient of their
// concentration. Each step reassembles gradient-ls-2, laplacian-ls-2 and the shift's operator, and solves
// lap p = f to a relative residual of 1e-8 from the p of the step before: by Poisson::update(), which keeps the
// coarser points, and by a new Poisson.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <gradpsi/gradpsi.hpp>
#include <optional>
#include <string>
#include <vector>

namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Points in a flow, with operators and the pressure's right-hand side.
class Flow {
 public:
  Flow(int side, int threads)
      : cloud(gradpsi::make_cloud(
            {.points_per_side = side, .jitter = 0.2, .seed = 1, .periodic = true})),
        threads_(threads) {
    search();
  }

  /// The seconds that reassembling the operators takes.
  double move() {
    Eigen::MatrixXd velocity = this->velocity();
    for (int a = 0; a < 2; ++a) velocity.col(a) += reach_ * operators_[2].axes[a].diagonal();
    cloud.move_to(cloud.positions() + dt_ * velocity);
    if (is_stale(near_, cloud)) search();
    const double start = seconds();
    reassemble(schemes_, cloud, near_, operators_, {.threads = threads_});
    return seconds() - start;
  }

  /// What divergence the points see over dt, and what the exact pressure has.
  Eigen::VectorXd right_hand_side() const {
    Eigen::MatrixXd divergence;
    multiply(gradpsi::VectorOperator::Divergence, operators_[0].axes, velocity(), divergence,
             threads_);
    const Eigen::ArrayXXd angle = 4 * M_PI * cloud.positions().array();
    return divergence.col(0) / dt_ +
           4 * M_PI * M_PI * (angle.col(0).cos() + angle.col(1).cos()).matrix();
  }

  const gradpsi::Operator& laplacian() const { return operators_[1]; }
  /// Of a row of the Laplacian, without those of its list's skin.
  double entries() const {
    const gradpsi::SparseMatrix& psi = laplacian().matrix();
    const auto values = Eigen::Map<const Eigen::ArrayXd>(psi.valuePtr(), psi.nonZeros());
    return static_cast<double>((values != 0).count()) / static_cast<double>(psi.rows());
  }

  gradpsi::Cloud cloud;

 private:
  void search() {
    near_ = find_neighbours(cloud, reach_, gradpsi::Skin{cloud.spacing() / 2}, threads_);
    operators_ = assemble(schemes_, cloud, near_, {.threads = threads_});
  }

  Eigen::MatrixXd velocity() const {
    const Eigen::ArrayXXd angle = 2 * M_PI * cloud.positions().array();
    Eigen::MatrixXd u(cloud.size(), 2);
    u << angle.col(0).sin() * angle.col(1).cos(), -angle.col(0).cos() * angle.col(1).sin();
    return u;
  }

  const std::vector<gradpsi::Scheme> schemes_ = {"gradient-ls-2", "laplacian-ls-2",
                                                 "gradient-direct-zoc"};
  int threads_;
  double dt_ = cloud.spacing() / 4, reach_ = 3.2 * cloud.spacing();
  gradpsi::Neighbours near_;
  std::vector<gradpsi::Operator> operators_;
};

/// How the pressure was solved for, in all steps together.
struct Total {
  double set_up = 0, solve = 0;
  int iterations = 0;
};

/// One step's pressure from `p`, by what there is or a new solver.
Eigen::VectorXd pressure(const Flow& flow, std::optional<gradpsi::Poisson>& poisson,
                         Eigen::VectorXd p, int threads, Total& total) {
  const Eigen::VectorXd f = flow.right_hand_side();
  const double start = seconds();
  if (poisson)
    poisson->update(flow.cloud, flow.laplacian());
  else
    poisson.emplace(
        flow.cloud, flow.laplacian(), gradpsi::BoundaryConditions{},
        gradpsi::SolverOptions{
            .method = gradpsi::Method::Multigrid, .tolerance = 1e-8, .threads = threads});
  const double ready = seconds();
  total.iterations += poisson->solve(f, p).iterations;
  total.set_up += ready - start;
  total.solve += seconds() - ready;
  return p;
}

void run(double points, int threads) {
  constexpr int steps = 100;
  Flow flow(static_cast<int>(std::lround(std::sqrt(points))), threads);
  std::optional<gradpsi::Poisson> kept;
  Eigen::VectorXd p = Eigen::VectorXd::Zero(flow.cloud.size());
  double assembly = 0;
  Total updated, anew;
  for (int step = 0; step < steps; ++step) {
    assembly += flow.move();
    std::optional<gradpsi::Poisson> none;
    pressure(flow, none, p, threads, anew);
    p = pressure(flow, kept, std::move(p), threads, updated);
  }
  for (const auto& [name, total] : {std::pair("updated", updated), std::pair("anew", anew)})
    std::printf("%d,%.0f,%.5f,%s,%.5f,%.5f,%.1f,%.2f\n", flow.cloud.size(), flow.entries(),
                assembly / steps, name, total.set_up / steps, total.solve / steps,
                double(total.iterations) / steps, (total.set_up + total.solve) / assembly);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<double> sizes;
  int threads = 1;
  for (int k = 1; k < argc; ++k)
    if (std::string(argv[k]) == "--threads" && k + 1 < argc)
      threads = std::atoi(argv[++k]);
    else
      sizes.push_back(std::atof(argv[k]));
  if (sizes.empty()) sizes = {6'400, 1e5};
  std::puts("points,entries_per_row,assembly_s,solver,setup_s,solve_s,iterations,of_assembly");
  for (const double points : sizes) run(points, threads);
}
