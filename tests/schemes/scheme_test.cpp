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

TEST(Scheme, ThoseOfAnyDegreeThePositiveOneAndHessiansFollow) {
  const auto rest = schemes().subspan(classified_schemes().size());
  std::vector<std::string> names;
  for (const Scheme& scheme : rest) names.push_back(name(scheme));
  EXPECT_THAT(names, testing::ElementsAre(
                         "laplacian-diffuse-soc-ls", "laplacian-diffuse-ns-soc-ls",
                         "laplacian-mixed-soc-ls", "laplacian-positive", "gradient-ls-1",
                         "gradient-ls-2", "gradient-ls-3", "gradient-ls-4", "gradient-ls-5",
                         "gradient-ls-6", "laplacian-ls-2", "laplacian-ls-3", "laplacian-ls-4",
                         "laplacian-ls-5", "laplacian-ls-6", "hessian-mixed-soc-ls", "hessian-ls-2",
                         "hessian-ls-3", "hessian-ls-4", "hessian-ls-5", "hessian-ls-6"));
}

// Theory's counts: P, P (P + 3) / 2 and (P + 1) (P + 2) (P + 3) / 6 - 1.
TEST(Scheme, HasAsManyUnknownsAsMonomials) {
  for (const Scheme& scheme : schemes()) {
    const int P = degree(scheme);
    EXPECT_EQ(unknowns(scheme, 1), P);
    EXPECT_EQ(unknowns(scheme, 2), P * (P + 3) / 2);
    EXPECT_EQ(unknowns(scheme, 3), (P + 1) * (P + 2) * (P + 3) / 6 - 1);
  }
}

TEST(Scheme, TheNameLeadsBackToTheScheme) {
  for (const Scheme& scheme : schemes()) EXPECT_EQ(Scheme(name(scheme)), scheme);
  EXPECT_EQ(Scheme("laplacian-diffuse-ns-soc"),
            Scheme(Derivative::Laplacian, Weight::DiffuseNs, Consistency::Soc));
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
