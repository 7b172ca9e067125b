#include <set>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::StartsWith;

TEST(Scheme, ThereAreNineGradientsAndEightLaplacians) {
  std::set<std::string> names;
  int gradients = 0;
  for (const Scheme& scheme : schemes()) {
    names.insert(name(scheme));
    gradients += scheme.derivative == Derivative::Gradient;
  }
  EXPECT_EQ(names.size(), 17u);
  EXPECT_EQ(gradients, 9);
}

TEST(Scheme, TheNameLeadsBackToTheScheme) {
  for (const Scheme& scheme : schemes()) EXPECT_EQ(Scheme(name(scheme)), scheme);
  EXPECT_EQ(Scheme("laplacian-diffuse-ns-soc"),
            Scheme(Derivative::Laplacian, Weight::DiffuseNs, Consistency::Soc));
}

TEST(Scheme, AnUnknownNameIsAnsweredWithTheNearestFirst) {
  EXPECT_THAT(message_of<InvalidInput>([] { Scheme("laplacian-mixd-soc"); }),
              StartsWith("unknown scheme 'laplacian-mixd-soc'; valid: laplacian-mixed-soc, "));
  // Well-formed, but not in the tables: no Laplacian has first-order consistency.
  EXPECT_THROW(Scheme("laplacian-mixed-foc"), InvalidInput);
  EXPECT_THROW(Scheme("gradient-mixed-soc"), InvalidInput);
  EXPECT_THROW(Scheme(""), InvalidInput);
}

TEST(Scheme, FormulasShowTheirWeight) {
  EXPECT_EQ(formula("laplacian-mixed-zoc"), "omega_j (-2 W'/r)");
  EXPECT_EQ(formula("gradient-diffuse-foc"), "omega_j (d W/r^2) B_i r_ij");
}

}  // namespace
}  // namespace gradpsi
