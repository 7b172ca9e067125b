// Derivatives within surfaces in three dimensions.

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "clouds.hpp"

namespace gradpsi {
namespace {

const AssemblyOptions on_surface{.on_surface = true};

/// A turn that no coordinate plane survives.
Eigen::Matrix3d turn() {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
}

Cloud placed(const Positions& x, const Eigen::Matrix3d& rotation) {
  return Cloud(Positions(x * rotation.transpose()));
}

/// Points on the unit sphere, near to evenly.
Positions sphere(int n) {
  Positions x(n, 3);
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, phi = i * std::numbers::pi * (3 - std::sqrt(5));
    x.row(i) << std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z;
  }
  return x;
}

/// Points on it anywhere.
Positions random_sphere(int n) {
  std::mt19937 generator(n);
  std::normal_distribution<double> normal;
  Positions x(n, 3);
  for (int i = 0; i < n; ++i) {
    for (double& coordinate : x.row(i)) coordinate = normal(generator);
    x.row(i).normalize();
  }
  return x;
}

double rms(const Eigen::ArrayXd& x) { return std::sqrt(x.square().mean()); }

class OnSurface : public testing::TestWithParam<Scheme> {};

// In a plane it is the plane's operator, for every scheme; the gradient's components are along the plane.
TEST_P(OnSurface, APlaneHasTheRowsOfTwoDimensions) {
  const Scheme scheme = GetParam();
  const Cloud flat = irregular_cloud(2, 14);
  Positions x = Positions::Zero(flat.size(), 3);
  x.leftCols(2) = flat.positions();
  const Eigen::Matrix3d R = turn();
  const Cloud tilted(Positions(x * R.transpose()), {.volumes = flat.volumes()});
  const double h = 3.9 * flat.spacing();
  const AssemblyOptions options{.on_degenerate = OnDegenerate::Lower};
  const AssemblyOptions within{.on_degenerate = OnDegenerate::Lower, .on_surface = true};
  const Operator plane = assemble(scheme, flat, find_neighbours(flat, h), options);
  const Operator surface = assemble(scheme, tilted, find_neighbours(tilted, h), within);
  for (int i = 0; i < flat.size(); ++i) {
    if (plane.rows.reciprocal_condition[i] < 1e-7) continue;
    EXPECT_EQ(surface.rows.outcome[i], plane.rows.outcome[i]) << i;
    EXPECT_NEAR(std::abs(surface.normals.row(i).dot(R.col(2))), 1, 1e-12);
    for (std::size_t a = 0; a < surface.axes.size(); ++a) {
      Eigen::VectorXd expected = plane.axes[0].row(i).transpose();
      if (surface.axes.size() == 3)
        expected = R(a, 0) * expected + R(a, 1) * plane.axes[1].row(i).transpose();
      const Eigen::VectorXd found = surface.axes[a].row(i).transpose();
      EXPECT_LT((found - expected).norm(), 1e-6 * (plane.axes[0].row(i).norm() + expected.norm()))
          << i;
    }
  }
}

std::vector<Scheme> for_surfaces() {
  std::vector<Scheme> result;
  for (const Scheme& scheme : schemes())
    if (scheme.derivative != Derivative::Hessian && degree(scheme) <= 3) result.push_back(scheme);
  std::erase(result, Scheme("gradient-normalized"));  // knows axes, not directions
  return result;
}

INSTANTIATE_TEST_SUITE_P(All, OnSurface, testing::ValuesIn(for_surfaces()),
                         [](const auto& scheme) { return identifier(name(scheme.param)); });

/// Errors of a Laplacian of the harmonic x y z, whose eigenvalue is -12, and of a gradient of it, at every
/// eighth point.
double error_on(const Positions& x, const Scheme& scheme, double neighbours) {
  const Cloud cloud(x);
  const double area = 4 * std::numbers::pi / cloud.size();
  std::vector<int> rows;
  for (int i = 0; i < cloud.size(); i += 8) rows.push_back(i);
  const Operator op = assemble(
      scheme, cloud, find_neighbours(cloud, std::sqrt(neighbours * area / std::numbers::pi)),
      {.rows = rows, .on_surface = true});
  const Eigen::VectorXd u = x.rowwise().prod();
  const Eigen::ArrayXd there = u(rows);
  const Eigen::ArrayXXd at = x(rows, Eigen::all);
  if (op.axes.size() == 1) return rms((op.matrix() * u).array() + 12 * there);
  Eigen::ArrayXXd off(at.rows(), 3);
  for (int a = 0; a < 3; ++a)
    off.col(a) = (op.axes[a] * u).array() - at.col((a + 1) % 3) * at.col((a + 2) % 3) +
                 3 * there * at.col(a);
  return rms(off.square().rowwise().sum().sqrt());
}

TEST(Surface, HarmonicsOfTheSphereConvergeWithTheOrderOfTheScheme) {
  struct Case {
    Scheme scheme;
    bool random;
    double neighbours, order, error;  // of 4,000 points
  };
  for (const auto& [scheme, random, neighbours, order, error] :
       {Case{"laplacian-ls-2", false, 20, 2, 4e-3}, Case{"laplacian-ls-3", false, 38, 2, 1e-2},
        Case{"laplacian-ls-4", false, 64, 4, 1e-4},
        Case{"laplacian-mixed-soc-ls", false, 28, 2, 1e-2},
        Case{"laplacian-ls-3", true, 70, 2, 2e-2}, Case{"laplacian-ls-4", true, 90, 4, 5e-4},
        Case{"gradient-ls-2", true, 45, 2, 1e-2}, Case{"gradient-ls-3", true, 70, 3, 1e-3}}) {
    const auto points = random ? random_sphere : sphere;
    const double coarse = error_on(points(1000), scheme, neighbours);
    const double fine = error_on(points(4000), scheme, neighbours);
    EXPECT_GT(std::log2(coarse / fine), order - 0.25) << name(scheme) << " on random: " << random;
    EXPECT_LT(fine, error) << name(scheme) << " on random: " << random;
  }
}

// The coordinates' Laplacian is the normal times twice the mean curvature: on an ellipsoid its three
// components agree on one normal, which is the gradient of the equation.
TEST(Surface, CurvatureOfAnEllipsoid) {
  const Eigen::Array3d half(1, 1.4, 0.8);
  Positions x = sphere(6000);
  for (int a = 0; a < 3; ++a) x.col(a) *= half[a];
  const Cloud cloud(x);
  std::vector<int> rows;
  for (int i = 0; i < cloud.size(); i += 7) rows.push_back(i);
  const Operator op = assemble("laplacian-ls-4", cloud, find_neighbours(cloud, 0.26),
                               {.rows = rows, .on_surface = true});
  for (int k = 0; k < op.matrix().rows(); ++k) {
    const int i = op.point(k);
    const Eigen::Array3d p = x.row(i).transpose();
    const Eigen::Vector3d outward = (p / half.square()).matrix();
    const Eigen::Vector3d normal = outward.normalized();
    // 2H of p_a^2 / half_a^2 = 1, the divergence of the unit normal.
    const double curvature =
        (half.square().inverse().sum() - (normal.array().square() / half.square()).sum()) /
        outward.norm();
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR((op.matrix().row(k) * x.col(a))(0), -curvature * normal[a], 2e-3);
    EXPECT_NEAR(std::abs(op.normals.row(k).dot(normal)), 1, 1e-6);
  }
}

// The height over the plane has no slope, so that coordinates have the gradient of a plane.
TEST(Surface, GradientsOfCoordinatesAreExact) {
  const Positions x = random_sphere(2000);
  const Cloud cloud = placed(x, turn());
  const Operator op = assemble("gradient-ls-3", cloud, find_neighbours(cloud, 0.33), on_surface);
  for (int i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d n = op.normals.row(i);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        EXPECT_NEAR((op.axes[a].row(i) * cloud.positions().col(b))(0), (a == b) - n[a] * n[b],
                    1e-9);
  }
}

TEST(Surface, TurnedPointsHaveTheSameLaplacian) {
  const Cloud cloud(sphere(500)), turned = placed(sphere(500), turn());
  const double h = 0.5;
  const SparseMatrix A =
      assemble("laplacian-ls-2", cloud, find_neighbours(cloud, h), on_surface).matrix();
  const SparseMatrix B =
      assemble("laplacian-ls-2", turned, find_neighbours(turned, h), on_surface).matrix();
  EXPECT_LT((A - B).norm(), 1e-10 * A.norm());
}

TEST(Surface, AreasOfASphereAddUp) {
  const Cloud cloud(sphere(2000));
  const Operator op = assemble("gradient-ls-2", cloud, find_neighbours(cloud, 0.25), on_surface);
  EXPECT_NEAR(op.volumes.sum() / (4 * std::numbers::pi), 1, 0.01);
}

// At the edge of a surface, walls are those of the plane that touches it.
TEST(Surface, EdgesOfAPlaneHaveTheWallsOfTwoDimensions) {
  const Cloud flat = irregular_cloud(2, 14);
  Positions x = Positions::Zero(flat.size(), 3);
  x.leftCols(2) = flat.positions();
  const Eigen::Matrix3d R = turn();
  const Cloud tilted(Positions(x * R.transpose()), {.volumes = flat.volumes()});
  FluxWalls walls;
  for (int i = 0; i < flat.size(); ++i)
    if (x(i, 0) < 0.08) walls.points.push_back(i);
  const auto count = std::ssize(walls.points);
  walls.normals = Eigen::RowVector2d(-2, 0).replicate(count, 1);
  walls.flux = DenseVector::LinSpaced(count, 1, 2);
  walls.transfer = DenseVector::LinSpaced(count, 3, 2);
  FluxWalls edges = walls;
  edges.normals = Eigen::RowVector3d(R * Eigen::Vector3d(-2, 0, 1)).replicate(count, 1);
  const double h = 3.9 * flat.spacing();
  const Neighbours near = find_neighbours(flat, h), around = find_neighbours(tilted, h);
  const WithWalls plane = with_walls(assemble("laplacian-ls-2", flat, near), flat, near, walls);
  const WithWalls surface =
      with_walls(assemble("laplacian-ls-2", tilted, around, on_surface), tilted, around, edges);
  EXPECT_EQ(surface.remaining.points, plane.remaining.points);
  EXPECT_LT(plane.remaining.points.size(), walls.points.size() / 2);
  EXPECT_LT((surface.source - plane.source).norm(), 1e-9 * plane.source.norm());
  EXPECT_LT((surface.laplacian.matrix() - plane.laplacian.matrix()).norm(),
            1e-9 * plane.laplacian.matrix().norm());
}

// Points of space are no surface, nor are two sheets within one support.
TEST(Surface, RowsAwayFromAnySurfaceAreDegenerate) {
  const Cloud cloud = irregular_cloud(3, 7);
  const Operator op = assemble("laplacian-ls-2", cloud, find_neighbours(cloud, 3 * cloud.spacing()),
                               {.on_degenerate = OnDegenerate::Zero, .on_surface = true});
  EXPECT_EQ(op.rows.degenerate(), cloud.size());
  EXPECT_EQ(op.matrix().toDense().cwiseAbs().maxCoeff(), 0);
  EXPECT_TRUE(op.normals.isZero(0));
  const std::string words = message_of<StencilError>([&] {
    assemble("laplacian-ls-2", cloud, find_neighbours(cloud, 3 * cloud.spacing()), on_surface);
  });
  EXPECT_THAT(words, testing::HasSubstr("lie on no surface"));
}

TEST(Surface, WidenedRowsAreThoseOfTheirSupport) {
  const Positions x = random_sphere(600);
  const Cloud cloud(x);
  const double h = 0.19;
  const Operator op = assemble("gradient-ls-2", cloud, find_neighbours(cloud, h),
                               {.on_degenerate = OnDegenerate::Widen, .on_surface = true});
  int widened = 0;
  for (int i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(op.normals.row(i).norm(), 1, 1e-14);
    if (op.rows.outcome[i] != RowOutcome::Widened || ++widened > 20) continue;
    const Operator alone =
        assemble("gradient-ls-2", cloud, find_neighbours(cloud, op.rows.supports[i]),
                 {.rows = std::vector<int>{i}, .on_surface = true});
    EXPECT_NEAR(std::abs(alone.normals.row(0).dot(op.normals.row(i))), 1, 1e-6);
  }
  EXPECT_GT(widened, 10);
}

TEST(Surface, HessiansAreRefusedAndPlanesStayAsTheyAre) {
  const Cloud cloud(sphere(100)), flat = irregular_cloud(2, 8);
  EXPECT_THROW(assemble("hessian-ls-2", cloud, find_neighbours(cloud, 1), on_surface),
               InvalidInput);
  const Neighbours near = find_neighbours(flat, rich_support(flat));
  const Operator plain = assemble("laplacian-ls-2", flat, near);
  const Operator same = assemble("laplacian-ls-2", flat, near, on_surface);
  EXPECT_EQ((plain.matrix() - same.matrix()).norm(), 0);
  EXPECT_EQ(same.normals.size(), 0);
}

// What the rows promise, they promise in the plane that touches.
TEST(Surface, DiagnosisLooksWithinThePlane) {
  const Cloud cloud(sphere(1000));
  for (const Scheme scheme : {Scheme("laplacian-ls-3"), Scheme("gradient-ls-2")}) {
    const Operator op = assemble(scheme, cloud, find_neighbours(cloud, 0.45), on_surface);
    const RowDiagnosis rows = diagnose(scheme, cloud, op);
    const int kept = degree(scheme);
    for (int k = 1; k <= kept; ++k)
      EXPECT_LT(rows.residuals.col(k).maxCoeff(), 1e-9) << name(scheme);
    EXPECT_GT(rows.residuals.col(kept + 1).minCoeff(), 1e-6);
    EXPECT_LT(rows.amplification.maxCoeff(), 10);
  }
}

}  // namespace
}  // namespace gradpsi
