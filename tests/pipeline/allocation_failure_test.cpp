// Memory that runs out in the stages of the pipeline.

#include "pipeline/failing_allocations.hpp"

namespace gradpsi {
namespace {

INSTANTIATE_TEST_SUITE_P(Failures, Fault20,
                         testing::Values(Failure{false, 1}, Failure{true, 1}, Failure{false, 2},
                                         Failure{true, 2}),
                         [](const auto& the_case) {
                           return std::string(the_case.param.all ? "all_from_then_on" : "one") +
                                  "_" + std::to_string(the_case.param.threads) + "_threads";
                         });

/// Points without volumes, so that those must be computed, more than a chunk of rows of them.
Cloud points(int dimension) {
  return Cloud(irregular_cloud(dimension, dimension == 3 ? 9 : 23).positions());
}

TEST_P(Fault20, Searches) {
  for (const int dimension : {1, 2, 3}) {
    const Cloud cloud = points(dimension), copy = cloud;
    const double support = 2.5 * cloud.spacing();
    const Neighbours near = find_neighbours(cloud, support);
    const Eigen::VectorXd volumes = number_density_volumes(cloud, near);
    const Eigen::VectorXd nearest = nearest_distances(cloud);
    const auto unchanged = [&] { return equal(cloud, copy); };
    fail_each(
        GetParam(), [&] { return equal(find_neighbours(cloud, support, threads()), near); },
        unchanged);
    fail_each(
        GetParam(),
        [&] { return number_density_volumes(cloud, near, kernels()[1], threads()).size() > 0; },
        unchanged);
    fail_each(
        GetParam(), [&] { return nearest_distances(cloud, threads()) == nearest; }, unchanged);
    fail_each(
        GetParam(), [&] { return std::ssize(reorder(cloud, threads()).order) == cloud.size(); },
        unchanged);
  }
}

TEST_P(Fault20, Assembly) {
  const std::vector<std::vector<Scheme>> all = {
      {"gradient-direct-soc"},
      {"laplacian-mixed-soc"},
      {"laplacian-positive"},
      {"laplacian-ls-4"},
      {"gradient-ls-2", "laplacian-ls-2", "laplacian-diffuse-zoc", "gradient-ls-3"}};
  struct Case {
    int points_per_side;
    double support_ratio;
    OnDegenerate policy;
  };
  // Several chunks of rows; and few points with too small a support, for policies to have something to do.
  for (const Case& c : {Case{23, 3.5, OnDegenerate::Lower}, Case{8, 2.0, OnDegenerate::Lower},
                        Case{8, 2.0, OnDegenerate::Widen}, Case{8, 2.0, OnDegenerate::Zero}}) {
    if (threads() > 1 && c.points_per_side < 23) continue;  // one chunk of rows, for one thread
    const Cloud cloud(irregular_cloud(2, c.points_per_side).positions()), copy = cloud;
    const Neighbours near = find_neighbours(cloud, c.support_ratio * cloud.spacing());
    const Neighbours near_copy = near;
    const AssemblyOptions options{.on_degenerate = c.policy, .threads = threads()};
    for (const auto& schemes : all) {
      if (threads() == 1 && c.points_per_side == 23 && schemes.size() == 1) continue;  // takes long
      SCOPED_TRACE(name(schemes[0]) + ", ratio " + std::to_string(c.support_ratio));
      const std::vector<Operator> expected = assemble(schemes, cloud, near, options);
      fail_each(
          GetParam(), [&] { return equal(assemble(schemes, cloud, near, options), expected); },
          [&] { return equal(cloud, copy) && equal(near, near_copy); });
    }
  }
}

TEST_P(Fault20, AssemblyThatFails) {
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 1.6 * cloud.spacing());
  fail_each(GetParam(), [&] {
    try {
      assemble("laplacian-mixed-soc", cloud, near, {.threads = threads()});
    } catch (const StencilError&) {
      return true;
    }
    return false;
  });
}

TEST_P(Fault20, Reassembly) {
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 4 * cloud.spacing());
  const AssemblyOptions options{.on_degenerate = OnDegenerate::Lower, .threads = threads()};
  for (const char* scheme : {"gradient-direct-soc", "laplacian-mixed-soc", "laplacian-ls-4"}) {
    Operator op = assemble(scheme, cloud, near, options);
    const std::vector<Operator> expected = {op};
    fail_each(
        GetParam(),
        [&] {
          reassemble(scheme, cloud, near, op, options);
          return op.volumes == expected[0].volumes && equal(op.matrix(), expected[0].matrix());
        },
        // Values may be old or new; the pattern stays.
        [&] {
          return op.axes.size() == expected[0].axes.size() &&
                 op.matrix().nonZeros() == expected[0].matrix().nonZeros();
        });
  }
}

TEST_P(Fault20, FieldsOfVectors) {
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 4 * cloud.spacing());
  const auto op = assemble({"gradient-ls-2", "hessian-ls-2"}, cloud, near);
  const Eigen::VectorXd mu = Eigen::VectorXd::Ones(cloud.size());
  const Eigen::MatrixXd v = mu.replicate(1, 2);
  const SparseMatrix curl = block_matrix(VectorOperator::Curl, op[0].axes),
                     force = viscous_force(op[1], op[0], mu);
  const std::vector<SparseMatrix> companion = conservative_companion(op[0]);
  const auto unchanged = [] { return true; };
  fail_each(
      GetParam(),
      [&] { return equal(block_matrix(VectorOperator::Curl, op[0].axes, threads()), curl); },
      unchanged);
  fail_each(
      GetParam(), [&] { return equal(viscous_force(op[1], op[0], mu, threads()), force); },
      unchanged);
  fail_each(
      GetParam(), [&] { return equal(conservative_companion(op[0], threads())[1], companion[1]); },
      unchanged);
  fail_each(
      GetParam(),
      [&] {
        DenseMatrix strain;
        multiply(VectorOperator::Strain, op[0].axes, v, strain, threads());
        return strain.size() == 3 * cloud.size();
      },
      unchanged);
}

/// (1 - dt lap) of a scheme: symmetric after scaling by volume for zoc, else not.
SparseMatrix implicit_matrix(const Operator& laplacian, double time_step) {
  SparseMatrix A = -time_step * laplacian.matrix();
  for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1;
  A.makeCompressed();
  return A;
}

// Matrices are passed by value. Eigen 3.4 has no move constructor for them, and its copy constructor loses
// the row offsets, one allocation, if there is no memory for the entries.
TEST_P(Fault20, Solvers) {
  Failure failure = GetParam();
  failure.lost = 1;
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 3.2 * cloud.spacing());
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(cloud.size(), 2), b_copy = b;
  struct Case {
    const char* scheme;
    Method method;
    double time_step;
  };
  for (const Case& c : {Case{"laplacian-mixed-zoc", Method::Cholesky, 1e-2},
                        Case{"laplacian-mixed-soc-ls", Method::Lu, 1e-3},
                        Case{"laplacian-mixed-soc-ls", Method::Krylov, 1e-4},
                        Case{"laplacian-mixed-zoc", Method::Krylov, 1.0},
                        Case{"laplacian-mixed-zoc", Method::Auto, 1e-2}}) {
    SCOPED_TRACE(std::string(c.scheme) + ", " + std::string(name(c.method)));
    const Operator op = assemble(c.scheme, cloud, near);
    const SystemPoints system{.cloud = Cloud(cloud.positions(), {.volumes = op.volumes})};
    const SparseMatrix A = implicit_matrix(op, c.time_step), copy = A;
    const SolverOptions options{.method = c.method, .threads = threads()};
    const auto right = [&](const Eigen::MatrixXd& x) {
      return (A * x - b).norm() < 1e-9 * b.norm();
    };
    const auto unchanged = [&] { return equal(A, copy) && b == b_copy; };
    fail_each(
        failure,
        [&] {
          LinearSolver solver(A, options, system);
          Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
          solver.solve(b, x);
          return right(x);
        },
        unchanged);
    LinearSolver solver(A, options, system);
    fail_each(
        failure,
        [&] {
          Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
          solver.refactor(A);
          solver.solve(b, x);
          return right(x);
        },
        unchanged);
  }
}

TEST_P(Fault20, Diffusion) {
  Failure failure = GetParam();
  failure.lost = 1;
  const Cloud cloud = points(2);
  const Neighbours near = find_neighbours(cloud, 3.2 * cloud.spacing());
  BoundaryConditions conditions;
  for (int i = 0; i < cloud.size(); ++i) {
    if (cloud.positions()(i, 0) < 0.05) conditions.fixed.points.push_back(i);
    if (cloud.positions()(i, 0) > 0.95) conditions.walls.points.push_back(i);
  }
  conditions.walls.normals = Eigen::RowVector2d(1, 0).replicate(conditions.walls.points.size(), 1);
  conditions.walls.gradient =
      assemble("gradient-direct-soc", cloud, near, {.rows = conditions.walls.points}).axes;
  const Operator laplacian = assemble("laplacian-mixed-soc-ls", cloud, near);
  const Eigen::MatrixXd u = Eigen::MatrixXd::Random(cloud.size(), 2);
  const DiffusionOptions options{.time_step = 1e-3, .theta = 0.5, .solver = {.threads = threads()}};
  ImplicitDiffusion heat(cloud, laplacian, conditions, options);
  Eigen::MatrixXd expected = u;
  heat.step(expected);
  const auto right = [&](const Eigen::MatrixXd& v) { return (v - expected).norm() < 1e-9; };
  fail_each(failure, [&] {
    ImplicitDiffusion one(cloud, laplacian, conditions, options);
    Eigen::MatrixXd v = u;
    one.step(v);
    return right(v);
  });
  // A step with another number of columns allocates.
  Eigen::MatrixXd v = u;
  Eigen::MatrixXd w = u.col(0);
  fail_each(
      failure,
      [&] {
        v = u, w = u.col(0);
        heat.step(w);
        heat.step(v);
        return right(v) && right((Eigen::MatrixXd(u.rows(), 2) << w, expected.col(1)).finished());
      },
      [&] { return v == u || right(v); });
}

TEST_P(Fault20, Diagnosis) {
  const Cloud cloud = irregular_cloud(2, 11);
  const Neighbours near = find_neighbours(cloud, 3 * cloud.spacing());
  const Operator op = assemble("laplacian-mixed-soc", cloud, near);
  std::vector<int> inside;
  for (int i = 0; i < cloud.size(); ++i)
    if (near.count(i) > 20) inside.push_back(i);
  fail_each(GetParam(), [&] {
    return diagnose("laplacian-mixed-soc", cloud, op).amplification.allFinite() &&
           summarise(op.matrix(), op.volumes).bandwidth > 0 &&
           forecast(cloud, op.matrix(), inside, op.volumes).rate < 1e9 &&
           spectrum(op.matrix()).complete && spectrum(op.matrix(), {}, 100).values.size() > 0;
  });
}

}  // namespace
}  // namespace gradpsi
