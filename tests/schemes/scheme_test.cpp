#include <set>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::StartsWith;

TEST(Scheme, NineGradientsAndEightLaplaciansAreClassified) {
  std::set<std::string> names;
  int gradients = 0;
  for (const Scheme& scheme : classified_schemes()) {
    names.insert(name(scheme));
    gradients += scheme.derivative == Derivative::Gradient;
  }
  EXPECT_EQ(names.size(), 17u);
  EXPECT_EQ(gradients, 9);
}

/// "ls-2", "ls-3", .. of a family.
std::vector<std::string> family(const std::string& name, int low, int high) {
  std::vector<std::string> all;
  for (int P = low; P <= high; ++P) all.push_back(name + std::to_string(P));
  return all;
}

TEST(Scheme, ThoseOfAnyDegreeThePositiveOneHessiansAndCitedOnesFollow) {
  std::vector<std::string> expected = {"laplacian-diffuse-soc-ls", "laplacian-diffuse-ns-soc-ls",
                                       "laplacian-mixed-soc-ls", "laplacian-positive"};
  const auto expect = [&](const std::vector<std::string>& names) {
    expected.insert(expected.end(), names.begin(), names.end());
  };
  expect(family("gradient-ls-", 1, 6));
  expect(family("laplacian-ls-", 2, 6));
  expect({"hessian-direct-zoc", "hessian-direct-soc", "hessian-diffuse-zoc", "hessian-diffuse-soc",
          "hessian-diffuse-ns-soc", "hessian-mixed-zoc", "hessian-mixed-soc",
          "hessian-diffuse-soc-ls", "hessian-diffuse-ns-soc-ls", "hessian-mixed-soc-ls"});
  expect(family("hessian-ls-", 2, 6));
  expect({"gradient-symmetric", "gradient-normalized", "gradient-fpm"});
  expect(family("gradient-mls-", 1, 6));
  expect({"gradient-msph", "gradient-rkpm-1", "gradient-rkpm-2", "laplacian-morris",
          "laplacian-cspm", "laplacian-icspm", "laplacian-msph"});
  expect(family("laplacian-mls-", 2, 6));
  expect({"laplacian-rkpm-2", "laplacian-kgf", "laplacian-kgf-improved", "hessian-icspm",
          "hessian-msph"});
  expect(family("hessian-mls-", 2, 6));
  expect({"hessian-rkpm-2"});
  expect(family("value-mls-", 0, 6));
  std::vector<std::string> names;
  for (const Scheme& scheme : schemes().subspan(classified_schemes().size()))
    names.push_back(name(scheme));
  EXPECT_EQ(names, expected);
}

// Theory's counts: P, P (P + 3) / 2 and (P + 1) (P + 2) (P + 3) / 6 - 1; CSPM has those of degree 2 only.
TEST(Scheme, HasAsManyUnknownsAsMonomials) {
  for (const Scheme& scheme : schemes()) {
    if (scheme == Scheme("laplacian-cspm")) continue;
    const int P = std::max(0, degree(scheme));
    EXPECT_EQ(unknowns(scheme, 1), P);
    EXPECT_EQ(unknowns(scheme, 2), P * (P + 3) / 2);
    EXPECT_EQ(unknowns(scheme, 3), (P + 1) * (P + 2) * (P + 3) / 6 - 1);
  }
  EXPECT_EQ(unknowns("laplacian-cspm", 1), 1);
  EXPECT_EQ(unknowns("laplacian-cspm", 3), 6);
}

TEST(Scheme, TheNameLeadsBackToTheScheme) {
  for (const Scheme& scheme : schemes()) EXPECT_EQ(Scheme(name(scheme)), scheme);
  EXPECT_EQ(Scheme("laplacian-diffuse-ns-soc"),
            Scheme(Derivative::Laplacian, Weight::DiffuseNs, Consistency::Soc));
}

TEST(Scheme, CitedSystemsAreSchemesByOneNameOrAnother) {
  for (const CitedSystem& cited : cited_systems()) {
    const Scheme scheme = cited.name;
    EXPECT_EQ(name(scheme), cited.equal_to.empty() ? cited.name : cited.equal_to);
  }
  EXPECT_EQ(Scheme("laplacian-fatehi-manzari"), Scheme("laplacian-mixed-soc"));
}

TEST(Fault15, AnUnknownSchemeIsAnsweredWithTheNearestFirst) {
  EXPECT_THAT(message_of<InvalidInput>([] { Scheme("laplacian-mixd-soc"); }),
              StartsWith("unknown scheme 'laplacian-mixd-soc'; valid: laplacian-mixed-soc, "));
  // Well-formed, but not in the tables: no Laplacian has first-order consistency.
  EXPECT_THROW(Scheme("laplacian-mixed-foc"), InvalidInput);
  EXPECT_THROW(Scheme("gradient-mixed-soc"), InvalidInput);
  // A Laplacian that need only be exact on linear functions is zero; direct's phi changes sign.
  EXPECT_THROW(Scheme("laplacian-ls-1"), InvalidInput);
  EXPECT_THROW(Scheme("laplacian-direct-soc-ls"), InvalidInput);
  EXPECT_THROW(Scheme(""), InvalidInput);
}

TEST(Scheme, FormulasShowTheirWeight) {
  EXPECT_EQ(formula("laplacian-mixed-zoc"), "omega_j (-2 W'/r)");
  EXPECT_EQ(formula("gradient-diffuse-foc"), "omega_j (d W/r^2) B_i r_ij");
  EXPECT_EQ(formula("laplacian-mixed-soc-ls"), "omega_j (-2 W'/r) c_i . p(r_ij)");
  EXPECT_EQ(formula("laplacian-ls-4"), "omega_j W c_i . p(r_ij)");
}

}  // namespace
}  // namespace gradpsi
