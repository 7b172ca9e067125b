// Coarser points, what is carried between them, and their equations.

#include "multigrid/hierarchy.hpp"

#include <cmath>
#include <numeric>

#include "clouds.hpp"
#include "multigrid/compact.hpp"
#include "multigrid/thinning.hpp"
#include "multigrid/transfer.hpp"

namespace gradpsi {
namespace {

/// Points, their lists and those of them that are kept.
struct Thinned {
  explicit Thinned(Cloud points, std::vector<char> marks = {})
      : cloud(std::move(points)),
        left_out(marks.empty() ? std::vector<char>(cloud.size(), false) : std::move(marks)),
        s(spacings(cloud)),
        near(find_neighbours(cloud, list_reach * s)),
        kept(thin(cloud, s, near, left_out)) {}
  Transfer transfer_of(const Medium& medium, int threads = 1) const {
    return transfer(cloud, s, near, list_reach, kept, left_out, medium, threads);
  }
  Medium even_medium() const {
    return {DenseVector::Constant(cloud.size(), 0.5), 3 * cloud.volumes()};
  }
  double distance(int i, int j) const {
    return (cloud.positions().row(i) - cloud.positions().row(j)).norm() / std::sqrt(s[i] * s[j]);
  }
  Cloud cloud;
  std::vector<char> left_out;
  DenseVector s;
  Neighbours near;
  std::vector<int> kept;
};

std::vector<Cloud> clouds() {
  std::vector<Cloud> result;
  for (const int d : {1, 2, 3}) {
    const int side = d == 1 ? 200 : d == 2 ? 30 : 12;
    result.push_back(irregular_cloud(d, side));
    result.push_back(make_cloud({.dimension = d, .points_per_side = side}));
    result.push_back(
        make_cloud({.dimension = d, .points_per_side = side, .jitter = 0.3, .grading = 10}));
  }
  return result;
}

TEST(Thinning, KeepsPointsThatAreApartAndNearAllOthers) {
  constexpr double apart[] = {2.2, 1.67, 1.75};
  for (const Cloud& cloud : clouds()) {
    const Thinned thinned(cloud);
    const double distance = apart[cloud.dimension() - 1];
    std::vector<char> is_kept(cloud.size(), false);
    for (const int i : thinned.kept) is_kept[i] = true;
    EXPECT_LT(2 * thinned.kept.size(), static_cast<std::size_t>(cloud.size()));
    for (int i = 0; i < cloud.size(); ++i) {
      double nearest = 1e9;
      for (const int k : thinned.kept)
        if (k != i) nearest = std::min(nearest, thinned.distance(i, k));
      if (is_kept[i])
        EXPECT_GE(nearest, distance) << i;
      else
        EXPECT_LT(nearest, distance) << i;
    }
  }
}

TEST(Thinning, NeverKeepsWhatIsLeftOut) {
  const Cloud cloud = irregular_cloud(2, 20);
  std::vector<char> left_out(cloud.size(), false);
  for (int i = 0; i < cloud.size(); i += 3) left_out[i] = true;
  for (const int i : Thinned(cloud, left_out).kept) EXPECT_FALSE(left_out[i]);
}

TEST(Transfers, KeepSumsVolumesAndMasses) {
  for (const Cloud& cloud : clouds()) {
    const Thinned thinned(cloud);
    const Transfer to = thinned.transfer_of(thinned.even_medium());
    const DenseVector ones = DenseVector::Ones(static_cast<Eigen::Index>(thinned.kept.size()));
    EXPECT_LT((to.interpolation.cast<double>() * ones - DenseVector::Ones(cloud.size()))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5);
    EXPECT_NEAR(to.volumes.sum(), cloud.volumes().sum(), 1e-5 * cloud.volumes().sum());
    EXPECT_GT(to.volumes.minCoeff(), 0);
    EXPECT_LT((to.medium.masses - 3 * to.volumes).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((to.medium.diffusivities.array() - 0.5).abs().maxCoeff(), 1e-12);
    const Eigen::SparseMatrix<float, Eigen::RowMajor> transposed = to.interpolation.transpose();
    EXPECT_EQ((transposed - to.restriction).norm(), 0);
    for (std::size_t k = 0; k < thinned.kept.size(); ++k)
      EXPECT_EQ(to.interpolation.coeff(thinned.kept[k], static_cast<int>(k)), 1);
  }
}

TEST(Transfers, CarryLinearFunctionsUpToTheRidgeThatHoldsThem) {
  const Thinned thinned(make_cloud({.points_per_side = 40, .jitter = 0.2}));
  const Transfer to = thinned.transfer_of(thinned.even_medium());
  const auto linear = [&](int i) {
    return thinned.cloud.positions()(i, 0) - 2 * thinned.cloud.positions()(i, 1);
  };
  DenseVector coarse(static_cast<Eigen::Index>(thinned.kept.size()));
  for (std::size_t k = 0; k < thinned.kept.size(); ++k) coarse[k] = linear(thinned.kept[k]);
  const DenseVector fine = to.interpolation.cast<double>() * coarse;
  const double dx = thinned.cloud.spacing();
  for (int i = 0; i < thinned.cloud.size(); ++i) {
    const auto x = thinned.cloud.positions().row(i).array();
    if (x.minCoeff() > 4 * dx && x.maxCoeff() < 1 - 4 * dx) {
      EXPECT_NEAR(fine[i], linear(i), 0.2 * dx);
    }
  }
}

TEST(Transfers, AMediumHasNoSayInAnother) {
  const Thinned thinned(make_cloud({.points_per_side = 40, .jitter = 0.2}));
  Medium medium = thinned.even_medium();
  for (int i = 0; i < thinned.cloud.size(); ++i)
    if (thinned.cloud.positions()(i, 0) > 0.5) medium.diffusivities[i] = 500;
  const Transfer to = thinned.transfer_of(medium);
  for (std::size_t k = 0; k < thinned.kept.size(); ++k)
    EXPECT_NEAR(to.medium.diffusivities[k], medium.diffusivities[thinned.kept[k]],
                1e-10 * medium.diffusivities[thinned.kept[k]]);
  // A point of the medium that conducts well takes next to nothing from beyond the interface.
  for (int i = 0; i < thinned.cloud.size(); ++i)
    for (SingleSparseMatrix::InnerIterator p(to.interpolation, i); p; ++p)
      if (medium.diffusivities[i] > 1 && medium.diffusivities[thinned.kept[p.col()]] < 1) {
        EXPECT_LT(p.value(), 0.05);
      }
}

Eigen::MatrixXd entries(const SingleSparseMatrix& S) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(S.rows(), S.cols());
  for (int i = 0; i < S.rows(); ++i)
    for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a) result(i, a.col()) = a.value();
  return result;
}

TEST(Compact, IsASymmetricMMatrixWithExactSecondMoments) {
  for (const Cloud& cloud : clouds()) {
    const DenseVector s = spacings(cloud);
    const Neighbours near = find_neighbours(cloud, list_reach * s);
    const Medium medium{DenseVector::Constant(cloud.size(), 0.5), 3 * cloud.volumes()};
    const SingleSparseMatrix S =
        compact_matrix(cloud, s, near, medium, std::vector<char>(cloud.size(), false), 1, 1);
    const Eigen::MatrixXd dense = entries(S);
    EXPECT_LT((dense - dense.transpose()).norm(), 1e-6 * dense.norm());
    const bool is_lattice = cloud.volumes().maxCoeff() == cloud.volumes().minCoeff() &&
                            cloud.positions()(0, 0) == cloud.positions()(1, 0);
    for (int i = 0; i < cloud.size(); ++i) {
      double sum = 0, second = 0, size = 0;
      for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a) {
        EXPECT_TRUE(a.col() == i ? a.value() > 0 : a.value() <= 0);
        sum += a.value();
        size += std::abs(a.value());
        second -=
            a.value() * (cloud.positions().row(i) - cloud.positions().row(a.col())).squaredNorm();
      }
      EXPECT_NEAR(sum, medium.masses[i], 1e-5 * size);
      const auto x = cloud.positions().row(i).array();
      if (is_lattice && x.minCoeff() > 0.3 && x.maxCoeff() < 0.7) {
        EXPECT_NEAR(second / (2 * cloud.dimension() * cloud.volumes()[i]), 0.5, 1e-5);
      }
    }
  }
}

DenseVector diffusivities(const SparseMatrix& A, const Cloud& cloud) {
  std::vector<int> diagonal(A.rows());
  std::iota(diagonal.begin(), diagonal.end(), 0);
  return row_diffusivities(A, cloud, diagonal, 1);
}

TEST(Medium, IsWhatTheRowsSay) {
  const Cloud cloud = periodic(irregular_cloud(2, 20));
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  SparseMatrix A = -2e-3 * assemble("laplacian-mixed-soc", cloud, near).matrix();
  for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1;
  std::vector<char> left_out(cloud.size(), false);
  left_out[5] = true;
  const Medium medium = medium_of(A, cloud.volumes(), diffusivities(A, cloud), left_out, {}, 1);
  EXPECT_LT((medium.diffusivities.array() / 2e-3 - 1).abs().maxCoeff(), 1e-9);
  for (int i = 0; i < cloud.size(); ++i)
    EXPECT_NEAR(medium.masses[i], i == 5 ? 0 : cloud.volumes()[i], 1e-10);
}

TEST(Medium, RowsThatLostNeighboursAskTheOthers) {
  const Cloud all = make_cloud({.dimension = 2, .points_per_side = 20, .jitter = 0.2});
  const Neighbours near = find_neighbours(all, 3 * all.spacing());
  const SparseMatrix psi = assemble("laplacian-mixed-zoc", all, near).matrix();
  const DiffusionSystem system(all, assemble("laplacian-mixed-zoc", all, near),
                               {.fixed = {.points = {0, 1, 2, 20, 21, 22, 40, 41, 42}}},
                               {.time_step = std::numeric_limits<double>::infinity()});
  const Cloud& cloud = system.points().cloud;
  const Medium medium =
      medium_of(system.matrix(), cloud.volumes(), diffusivities(system.matrix(), cloud),
                std::vector<char>(cloud.size(), false), {}, 1);
  for (int i = 0; i < cloud.size(); ++i) {
    if ((cloud.positions().row(i).array() > 0.5).any()) continue;  // near the fixed corner
    EXPECT_GT(medium.diffusivities[i], 0.4);
    EXPECT_LT(medium.diffusivities[i], 1.2);
  }
  EXPECT_GT(medium.masses.maxCoeff(), 0);
}

TEST(Hierarchy, GoesDownToAFewHundredPoints) {
  const Cloud cloud = irregular_cloud(2, 70);
  const Medium medium{DenseVector::Ones(cloud.size()), DenseVector::Zero(cloud.size())};
  const std::vector<char> left_out(cloud.size(), false);
  const std::vector<CoarseLevel> levels = coarser_levels(cloud, medium, left_out, 1, 1);
  ASSERT_EQ(levels.size(), 2);
  Eigen::Index size = cloud.size();
  for (const CoarseLevel& level : levels) {
    EXPECT_EQ(level.interpolation.rows(), size);
    size = level.interpolation.cols();
    EXPECT_EQ(level.matrix.rows(), size);
  }
  EXPECT_LE(size, 500);
  // Of few points there is one coarser level; a lone point is its own.
  const std::vector<char> alone(1, false);
  EXPECT_EQ(coarser_levels(irregular_cloud(2, 4), {DenseVector::Ones(16), DenseVector::Zero(16)},
                           std::vector<char>(16, false), 1, 1)
                .size(),
            1);
}

// A multiple of a medium has the levels that it would have had from the start.
TEST(Hierarchy, IsRenewedForAMultipleOfItsMedium) {
  const Cloud cloud = make_cloud({.points_per_side = 60, .jitter = 0.3, .grading = 5});
  const std::vector<char> left_out(cloud.size(), false);
  const DenseVector waves = 0.1 * (7 * cloud.positions().col(0).array()).sin();
  const DenseVector losses = cloud.volumes().array() * (1 + waves.array());
  const Medium before{DenseVector(2 + waves.array()), DenseVector(losses + 3 * cloud.volumes())};
  const Medium now{DenseVector(40 + 20 * waves.array()),
                   DenseVector(20 * losses + 7 * cloud.volumes())};
  std::vector<CoarseLevel> levels = coarser_levels(cloud, before, left_out, 0.5, 1);
  const std::vector<CoarseLevel> anew = coarser_levels(cloud, now, left_out, 0.5, 1);
  const std::optional<MediumChange> by = change(before, now, cloud);
  ASSERT_TRUE(by);
  EXPECT_NEAR(by->diffusivity, 20, 1e-10);
  ASSERT_EQ(levels.size(), anew.size());
  for (std::size_t l = 0; l < levels.size(); ++l) {
    renew(levels[l], *by, 0.5);
    EXPECT_LT((levels[l].matrix - anew[l].matrix).norm(), 1e-5 * anew[l].matrix.norm());
    EXPECT_LT((levels[l].masses - anew[l].masses).norm(), 1e-9 * anew[l].masses.norm());
  }
}

TEST(Medium, IsNoMultipleWhereMoreThanAPointInAHundredIsDifferent) {
  const Cloud cloud = make_cloud({.points_per_side = 20});
  const Medium before{DenseVector::Ones(400), 2 * cloud.volumes()};
  Medium now{DenseVector::Constant(400, 3), 5 * cloud.volumes()};
  for (int i = 0; i < 4; ++i) now.diffusivities[i] = 30;
  const auto by = change(before, now, cloud);
  ASSERT_TRUE(by);
  EXPECT_EQ(by->diffusivity, 3);
  EXPECT_NEAR(by->rate_before, 2, 1e-12);
  EXPECT_NEAR(by->rate, 5, 1e-12);
  now.masses[7] += 100 * now.diffusivities[7];
  EXPECT_FALSE(change(before, now, cloud));
  now.masses[7] = now.masses[8];
  now.diffusivities[9] = 1;
  EXPECT_FALSE(change(before, now, cloud));
  EXPECT_FALSE(change({DenseVector::Zero(400), before.masses}, now, cloud));
}

TEST(Hierarchy, NeedsVolumesThatAreThePoints) {
  const Cloud cloud = irregular_cloud(2, 40);
  const Cloud wrong(cloud.positions(), {.volumes = 1e-6 * cloud.volumes()});
  EXPECT_THROW(coarser_levels(wrong, {DenseVector::Ones(1600), DenseVector::Zero(1600)},
                              std::vector<char>(1600, false), 1, 1),
               NoHierarchy);
}

}  // namespace
}  // namespace gradpsi
