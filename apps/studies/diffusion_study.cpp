// What implicit diffusion gets right, and how well.
//
//     gradpsi_diffusion_study [--quick]
//
// prints a CSV.
// - time, space: orders on decaying modes of the unit interval, square and cube, u = sin(pi x) .. between
//   walls held at 0, u = cos(pi x) .. between walls without flux. Expect order 1 in time from backward
//   Euler and 2 from Crank-Nicolson; in space none without correction and 2 with second-order consistency.
// - poisson: lap u = f on the unit square, 40 x 40 points, the outermost fixed.
// - slab: the temperature where conductivities 1 and 10 meet, by the harmonic and the arithmetic mean.

#include <cmath>
#include <cstdio>
#include <gradpsi/gradpsi.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double usual_support_ratio = 3;

enum class Walls { Fixed, NoFlux };

/// Points on the walls and, jittered by up to `jitter` spacings, between them, with a mode.
struct Mode {
  Mode(int dimension, int intervals, double jitter, Walls walls)
      : cloud(points(dimension, intervals, jitter)), spacing(1.0 / intervals) {
    const auto x = (pi * cloud.positions().array()).eval();
    u = (walls == Walls::Fixed ? x.sin().rowwise().prod().eval() : x.cos().rowwise().prod().eval());
    near = find_neighbours(cloud, usual_support_ratio * spacing);
    std::vector<int> on_walls;
    for (int i = 0; i < cloud.size(); ++i)
      if (normal(i).any()) on_walls.push_back(i);
    if (walls == Walls::Fixed) {
      conditions.fixed.points = on_walls;
      for (const int i : on_walls) u[i] = 0;
      return;
    }
    conditions.walls.points = on_walls;
    conditions.walls.normals.resize(static_cast<Eigen::Index>(on_walls.size()), dimension);
    for (std::size_t k = 0; k < on_walls.size(); ++k)
      conditions.walls.normals.row(static_cast<Eigen::Index>(k)) = normal(on_walls[k]);
    conditions.walls.gradient =
        assemble("gradient-direct-soc", cloud, near, {.rows = on_walls}).axes;
  }

  static gradpsi::Cloud points(int dimension, int intervals, double jitter) {
    // The lattice's cells are centred on what are the points here.
    const double dx = 1.0 / intervals;
    const gradpsi::Lattice lattice{.dimension = dimension,
                                   .points_per_side = intervals + 1,
                                   .lower = -dx / 2,
                                   .upper = 1 + dx / 2,
                                   .jitter = jitter};
    gradpsi::Lattice regular = lattice;
    regular.jitter = 0;
    gradpsi::Positions x = make_cloud(lattice).positions();
    const gradpsi::Positions on_lattice = make_cloud(regular).positions();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      for (Eigen::Index a = 0; a < x.cols(); ++a)
        for (const double wall : {0.0, 1.0})
          if (std::abs(on_lattice(i, a) - wall) < dx / 4) x(i, a) = wall;
    return gradpsi::Cloud(
        x, {.volumes = Eigen::VectorXd::Constant(x.rows(), std::pow(dx, dimension))});
  }

  Eigen::RowVectorXd normal(int i) const {
    const auto x = cloud.positions().row(i).array();
    return (x == 1).cast<double>() - (x == 0).cast<double>();
  }

  double rate() const { return pi * pi * cloud.dimension(); }

  /// The field after `steps` steps up to `time`, from one that meets the walls' conditions as the
  /// matrix has them: a step of no length sees to that. From any other Crank-Nicolson is of order 1.
  Eigen::VectorXd after(const gradpsi::Operator& laplacian, double time, int steps,
                        double theta) const {
    Eigen::VectorXd now = u;
    gradpsi::ImplicitDiffusion heat(cloud, laplacian, conditions,
                                    {.time_step = 1e-9 * time, .theta = theta});
    heat.step(now);
    heat.set_time_step(time / steps);
    for (int n = 0; n < steps; ++n) heat.step(now);
    return now;
  }

  gradpsi::Cloud cloud;
  double spacing;
  gradpsi::Neighbours near;
  Eigen::VectorXd u;
  gradpsi::BoundaryConditions conditions;
};

/// Points that are not within a spacing of the unit square's edge; those that are, are fixed.
std::vector<int> fix_edge(const gradpsi::Cloud& cloud, gradpsi::BoundaryConditions& conditions) {
  std::vector<int> inside;
  const double dx = cloud.spacing();
  for (int i = 0; i < cloud.size(); ++i) {
    const auto x = cloud.positions().row(i);
    const bool at_edge = x.minCoeff() < dx || x.maxCoeff() > 1 - dx;
    (at_edge ? conditions.fixed.points : inside).push_back(i);
  }
  return inside;
}

double rms(const Eigen::VectorXd& error) {
  return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

/// Lines of the CSV, with the order between each error and the one before.
void print(const char* what, int dimension, Walls walls, double jitter, const std::string& method,
           const std::vector<double>& sizes, const std::vector<double>& errors,
           double support_ratio = usual_support_ratio) {
  for (std::size_t k = 0; k < errors.size(); ++k) {
    std::printf("%s,%d,%s,%g,%s,%g,%.6g,%.4g,", what, dimension,
                walls == Walls::Fixed ? "fixed" : "no-flux", jitter, method.c_str(), support_ratio,
                sizes[k], errors[k]);
    if (k > 0)
      std::printf("%.2f", std::log(errors[k - 1] / errors[k]) / std::log(sizes[k - 1] / sizes[k]));
    std::printf("\n");
  }
  std::fflush(stdout);
}

/// Against small steps on the same points, so that space has no part in the error.
void study_time(int dimension, Walls walls, bool quick) {
  const Mode mode(dimension, dimension == 3 ? 8 : quick ? 16 : 32, 0.2, walls);
  const auto laplacian = assemble("laplacian-mixed-zoc", mode.cloud, mode.near);
  const double time = 1 / mode.rate();
  const Eigen::VectorXd limit = mode.after(laplacian, time, 1280, 0.5);
  for (const double theta : {1.0, 0.5}) {
    std::vector<double> sizes, errors;
    for (const int steps : {20, 40, 80}) {
      sizes.push_back(time / steps);
      errors.push_back(rms(mode.after(laplacian, time, steps, theta) - limit));
    }
    print("time", dimension, walls, 0.2, theta == 1 ? "backward-euler" : "crank-nicolson", sizes,
          errors);
  }
}

/// Against the mode's own decay by a factor e, with steps too small to matter.
void study_space(int dimension, Walls walls, double jitter, const std::string& scheme, bool quick) {
  std::vector<std::vector<int>> intervals = {
      {20, 40, 80, 160, 320}, {10, 20, 40, 80}, {6, 9, 13, 19}};
  if (quick) intervals = {{20, 40, 80}, {10, 20, 40}, {9, 13}};
  std::vector<double> sizes, errors;
  for (const int m : intervals[dimension - 1]) {
    const Mode mode(dimension, m, jitter, walls);
    const auto laplacian = assemble(scheme, mode.cloud, mode.near);
    const Eigen::VectorXd decayed = mode.after(laplacian, 1 / mode.rate(), 200, 0.5);
    sizes.push_back(mode.spacing);
    errors.push_back(rms(decayed - mode.u / std::numbers::e));
  }
  print("space", dimension, walls, jitter, scheme, sizes, errors);
}

/// Root mean square over the points that are not fixed, u = sin(2.5 x) cos(2.5 y), three clouds.
void study_poisson(const std::string& scheme, double support_ratio) {
  double squared = 0, count = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const gradpsi::Cloud cloud =
        make_cloud(gradpsi::Lattice{.points_per_side = 40, .jitter = 0.2, .seed = seed});
    const auto near = find_neighbours(cloud, support_ratio * cloud.spacing());
    gradpsi::BoundaryConditions conditions;
    const std::vector<int> inside = fix_edge(cloud, conditions);
    const auto x = cloud.positions().array();
    const Eigen::VectorXd exact = (2.5 * x.col(0)).sin() * (2.5 * x.col(1)).cos();
    Eigen::VectorXd u = exact;
    gradpsi::ImplicitDiffusion steady(cloud, assemble(scheme, cloud, near), conditions,
                                      {.time_step = infinity, .source = 2 * 2.5 * 2.5 * exact});
    steady.step(u);
    squared += (u - exact).squaredNorm();
    count += static_cast<double>(inside.size());
  }
  print("poisson", 2, Walls::Fixed, 0.2, scheme, {1.0 / 40}, {std::sqrt(squared / count)},
        support_ratio);
}

/// kappa = 1 for x < 1/2 and 10 beyond, u(0) = 0, u(1) = 1: u = 10/11 at the interface, which lies
/// midway between two columns of points; that on the left, where u is steep, is looked at.
void study_slab(const std::string& scheme, double jitter, gradpsi::Mean mean) {
  const gradpsi::Cloud cloud =
      make_cloud(gradpsi::Lattice{.points_per_side = 60, .jitter = jitter});
  const double dx = cloud.spacing();
  const auto near = find_neighbours(cloud, usual_support_ratio * dx);
  const auto x = cloud.positions().col(0).array();
  const Eigen::VectorXd kappa = (x < 0.5).select(Eigen::ArrayXd::Ones(x.size()), 10.0);
  const Eigen::VectorXd exact = (x < 0.5).select(x * 20 / 11, 1 - (1 - x) * 2 / 11);
  gradpsi::BoundaryConditions conditions;
  fix_edge(cloud, conditions);
  Eigen::VectorXd u = exact;
  gradpsi::ImplicitDiffusion steady(cloud,
                                    with_conductivity(assemble(scheme, cloud, near), kappa, mean),
                                    conditions, {.time_step = infinity});
  steady.step(u);
  double sum = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (x[i] < 0.5 && x[i] > 0.5 - dx) sum += u[i] - exact[i], ++count;
  print(mean == gradpsi::Mean::Harmonic ? "slab-harmonic" : "slab-arithmetic", 2, Walls::Fixed,
        jitter, scheme, {dx}, {std::abs(sum / count) / (10.0 / 11)});
}

}  // namespace

int main(int argc, char** argv) try {
  const bool quick = argc == 2 && std::string(argv[1]) == "--quick";
  if (argc > 1 && !quick) {
    std::fprintf(stderr, "Usage: %s [--quick]\n", argv[0]);
    return 2;
  }
  std::printf("of,dimension,walls,jitter,method,support_ratio,step,error,order\n");
  for (const int dimension : {1, 2, 3})
    for (const Walls walls : {Walls::Fixed, Walls::NoFlux}) {
      study_time(dimension, walls, quick);
      for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"})
        for (const double jitter : {0.0, 0.2}) study_space(dimension, walls, jitter, scheme, quick);
    }
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    for (const double support_ratio : {2.5, 3.5}) study_poisson(scheme, support_ratio);
    for (const double jitter : {0.0, 0.2})
      for (const auto mean : {gradpsi::Mean::Harmonic, gradpsi::Mean::Arithmetic})
        study_slab(scheme, jitter, mean);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
