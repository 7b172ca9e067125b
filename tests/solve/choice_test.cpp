// What a system is solved with, by what is known of it.

#include "solve/choice.hpp"

#include <numeric>

#include "clouds.hpp"
#include "matrix/checks.hpp"
#include "multigrid/medium.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;

TEST(Choice, GoesToWhatIsLeft) {
  Traits traits{.unknowns = 100, .dimension = 2, .symmetric = true, .stiffness = 1e3};
  EXPECT_EQ(choose(traits, Method::Auto).method, Method::Cholesky);
  const Choice large = choose(traits, Method::Auto, {{Method::Cholesky, "it is large"}});
  EXPECT_EQ(large.method, Method::Krylov);
  EXPECT_EQ(large.reason, "the matrix is symmetric, but it is large");
  traits.indefinite = true;
  EXPECT_EQ(choose(traits, Method::Auto).method, Method::Lu);
  EXPECT_THAT(choose(traits, Method::Auto).reason, HasSubstr("not positive definite"));
  traits.symmetric = false;
  EXPECT_EQ(choose(traits, Method::Auto).method, Method::Lu);
  const Choice last = choose(traits, Method::Auto, {{Method::Lu, "it is large"}});
  EXPECT_EQ(last.method, Method::Krylov);
  EXPECT_THAT(last.reason, HasSubstr("100 unknowns"));
  EXPECT_THAT(last.reason, HasSubstr("and for LU it is large"));
  EXPECT_EQ(successor(last).method, Method::Lu);
}

TEST(Choice, IsWhatWasAskedFor) {
  Traits traits{.unknowns = 1'000'000, .dimension = 3, .symmetric = true};
  for (const bool spread : {false, true}) {
    traits.spread = spread;
    for (const Method method : {Method::Cholesky, Method::Lu, Method::Krylov}) {
      const Choice choice = choose(traits, method);
      EXPECT_EQ(choice.method, method);
      EXPECT_EQ(choice.reason, "as asked");
      EXPECT_FALSE(choice.provisional);
      EXPECT_EQ(most_iterations(choice, {.max_iterations = 5'000}), 5'000);
    }
    EXPECT_EQ(most_iterations(choose(traits, Method::Auto, {{Method::Cholesky, "-"}}),
                              {.max_iterations = 5'000}),
              1'000);
  }
  traits.symmetric = false;
  EXPECT_THROW(choose(traits, Method::Cholesky), InvalidInput);
}

TEST(Choice, FactorisesNoSystemThatIsSpreadUnasked) {
  for (const bool symmetric : {false, true})
    for (const double unknowns : {10.0, 1e9}) {
      const Traits traits{.unknowns = static_cast<std::int64_t>(unknowns),
                          .dimension = 2,
                          .symmetric = symmetric,
                          .spread = true,
                          .stiffness = 1e4};
      EXPECT_TRUE(iterates(choose(traits, Method::Auto).method));
    }
}

TEST(Choice, WeighsPreparingAgainstSolving) {
  // A problem of a million unknowns in space, and in the plane, once and again and again.
  for (const int dimension : {2, 3}) {
    Traits traits{.unknowns = 1'000'000,
                  .dimension = dimension,
                  .symmetric = true,
                  .dominant = true,
                  .stiffness = 1e5};
    EXPECT_EQ(choose(traits, Method::Auto).method, Method::Multigrid);
    traits.solves = 100;
    EXPECT_EQ(choose(traits, Method::Auto).method,
              dimension == 2 ? Method::Cholesky : Method::Multigrid);
    traits.stiffness = 1;
    traits.solves = 1;
    EXPECT_EQ(choose(traits, Method::Auto).method, Method::Krylov);
    traits.stiffness = 1e5;
    const Choice other = choose(traits, Method::Auto, {{Method::Multigrid, "points coincide"}});
    EXPECT_NE(other.method, Method::Multigrid);
    EXPECT_NE(other.preconditioner, Preconditioner::Points);
  }
}

TEST(Choice, LeavesTheDiagonalForStiffSystemsOnly) {
  for (const int dimension : {1, 2, 3})
    for (const bool spread : {false, true})
      for (const bool walls : {false, true}) {
        Traits traits{
            .unknowns = 1'000'000, .dimension = dimension, .walls = walls, .spread = spread};
        Preconditioner before = Preconditioner::Diagonal;
        int changes = 0;
        for (double stiffness = 0.1; stiffness < 1e7; stiffness *= 1.5) {
          traits.stiffness = stiffness;
          const Preconditioner now = choose(traits, Method::Krylov).preconditioner;
          changes += now != before;
          before = now;
        }
        EXPECT_EQ(changes, 1);
        EXPECT_EQ(before, Preconditioner::Points);
        EXPECT_EQ(by_entries(traits) == Preconditioner::TwinMultigrid, walls || dimension == 3);
        traits.stiffness = std::numeric_limits<double>::quiet_NaN();
        EXPECT_EQ(choose(traits, Method::Krylov).preconditioner, Preconditioner::Diagonal);
      }
}

TEST(Traits, OfPartsAreThoseOfTheWhole) {
  const Cloud cloud = irregular_cloud(2, 12);
  const Neighbours near = find_neighbours(cloud, rich_support(cloud));
  for (const std::string scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    SparseMatrix A = -assemble(scheme, cloud, near).matrix();
    for (int i = 0; i < A.rows(); ++i) A.coeffRef(i, i) += 1e3;
    std::vector<int> diagonal(cloud.size());
    std::iota(diagonal.begin(), diagonal.end(), 0);
    const LinearSystem whole{.A = A,
                             .points = {cloud},
                             .scale = cloud.volumes(),
                             .diffusivities = row_diffusivities(A, cloud, diagonal, 0)};
    const std::vector<int> all = whole.diagonal();
    const RowTraits expected = row_traits(A, cloud, all, 0);
    EXPECT_EQ(expected.dominant, is_dominant(A));
    bool dominant = true;
    for (const auto& [begin, end] : {std::pair(0, 50), std::pair(50, cloud.size())}) {
      const std::vector<int> some(all.begin() + begin, all.begin() + end);
      const RowTraits part = row_traits(A.middleRows(begin, end - begin), cloud, some, 0);
      EXPECT_EQ(part.stiffness, expected.stiffness.segment(begin, end - begin));
      dominant = dominant && part.dominant;
    }
    EXPECT_EQ(dominant, expected.dominant) << scheme;
    // A = I / dt - Psi: dt / dx^2 where rows are consistent, as inner ones are.
    const double dx = std::sqrt(cloud.volumes().mean());
    EXPECT_NEAR(traits(whole).stiffness, 1e-3 / (dx * dx), 0.3 * 1e-3 / (dx * dx));
  }
}

}  // namespace
}  // namespace gradpsi
