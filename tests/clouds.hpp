#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <gradpsi/gradpsi.hpp>
#include <random>
#include <string>

namespace gradpsi {

/// An irregular cloud on the unit square or cube: a lattice jittered by a quarter cell, with
/// unequal volumes, points in random order.
inline Cloud irregular_cloud(int dimension, int points_per_side, std::uint64_t seed = 1) {
  const Cloud lattice = make_cloud(Lattice{
      .dimension = dimension, .points_per_side = points_per_side, .jitter = 0.25, .seed = seed});
  std::mt19937_64 generator(seed + 1000);
  std::vector<int> order(lattice.size());
  for (int i = 0; i < lattice.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), generator);
  Eigen::VectorXd volumes = lattice.volumes();
  std::uniform_real_distribution<double> factor(0.7, 1.4);
  for (double& v : volumes) v *= factor(generator);
  return Cloud(lattice.positions()(order, Eigen::all), {.volumes = volumes});
}

/// Enough support for every compact scheme, up to the corners.
inline double rich_support(const Cloud& cloud) {
  return (cloud.dimension() == 1 ? 3.2 : 2.9) * cloud.spacing();
}

/// The same points in a periodic unit box.
inline Cloud periodic(const Cloud& cloud) {
  CloudOptions options{.volumes = cloud.volumes()};
  std::fill_n(options.box.begin(), cloud.dimension(), 1.0);
  return Cloud(cloud.positions(), options);
}

/// One support per point, up to the rich one.
inline Eigen::VectorXd uneven_supports(const Cloud& cloud) {
  return Eigen::VectorXd::LinSpaced(cloud.size(), 0.93, 1) * rich_support(cloud);
}

/// Test parameters: a scheme and a dimension, named laplacian_mixed_soc_3d.
using SchemeAndDimension = std::tuple<Scheme, int>;

inline std::string identifier(std::string text) {
  std::ranges::replace(text, '-', '_');
  return text;
}

inline std::string case_name(const testing::TestParamInfo<SchemeAndDimension>& info) {
  const auto& [scheme, dimension] = info.param;
  return identifier(name(scheme)) + "_" + std::to_string(dimension) + "d";
}

/// The schemes that rich_support() is enough for, in every row: of at most second order, and not
/// positive. Given a degree, those that are exact on polynomials of that degree.
inline std::vector<Scheme> compact_schemes(int least = 0) {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (degree(scheme) >= least && degree(scheme) <= 2 &&
        scheme.consistency != Consistency::Positive)
      chosen.push_back(scheme);
  return chosen;
}

inline auto compact_schemes_and_dimensions() {
  return testing::Combine(testing::ValuesIn(compact_schemes()), testing::Values(1, 2, 3));
}

/// GoogleTest prints parameters by this name.
inline void PrintTo(const Scheme& scheme, std::ostream* out) { *out << name(scheme); }

/// The type and words of an error.
template <class Error, class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "expected an exception";
  return {};
}

}  // namespace gradpsi
