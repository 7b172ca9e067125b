#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <gradpsi/gradpsi.hpp>
#include <string>
#include <tuple>
#include <vector>

namespace gradpsi {

/// An irregular cloud on the unit square or cube: a lattice jittered by a quarter cell, with
/// unequal volumes, points in random order.
Cloud irregular_cloud(int dimension, int points_per_side, std::uint64_t seed = 1);

/// Enough support for every compact scheme, up to the corners.
double rich_support(const Cloud& cloud);

/// The same points in a periodic unit box.
Cloud periodic(const Cloud& cloud);

/// One support per point, up to the rich one.
Eigen::VectorXd uneven_supports(const Cloud& cloud);

/// Test parameters: a scheme and a dimension, named laplacian_mixed_soc_3d.
using SchemeAndDimension = std::tuple<Scheme, int>;

std::string identifier(std::string text);

std::string case_name(const testing::TestParamInfo<SchemeAndDimension>& info);

/// The schemes that rich_support() is enough for, in every row: of at most second order, and not
/// positive. Given a degree, those that are exact on polynomials of that degree.
std::vector<Scheme> compact_schemes(int least = 0);

inline auto compact_schemes_and_dimensions() {
  return testing::Combine(testing::ValuesIn(compact_schemes()), testing::Values(1, 2, 3));
}

/// GoogleTest prints parameters by this name.
inline void PrintTo(const Scheme& scheme, std::ostream* out) { *out << name(scheme); }

/// The entries that are not zero.
SparseMatrix sparse(const Eigen::MatrixXd& dense);

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
