#include "multigrid/thinning.hpp"

#include <cmath>

#include "base/dispatch.hpp"
#include "cloud/points.hpp"

namespace gradpsi {
namespace {

constexpr double apart[] = {2.2, 1.67, 1.75};  // by dimension - 1

enum class Mark : char { Free, Kept, Out };

template <int D>
std::vector<int> thin(const Cloud& cloud, const DenseVector& s, const Neighbours& near,
                      const std::vector<char>& left_out) {
  constexpr double squared = apart[D - 1] * apart[D - 1];
  std::vector<Mark> marks(cloud.size(), Mark::Free);
  std::vector<int> kept;
  const auto is_near = [&](int i, int j) {
    return squared_distance<D>(cloud, i, j) < squared * s[i] * s[j];
  };
  // A list that ends before a near point of much larger spacing is made up for by that point's own.
  const auto has_kept = [&](int i) {
    for (const int j : near.of(i))
      if (marks[j] == Mark::Kept && is_near(i, j)) return true;
    return false;
  };
  for (const int i : near.order) {
    if (left_out[i] || marks[i] == Mark::Out || has_kept(i)) continue;
    marks[i] = Mark::Kept;
    kept.push_back(i);
    for (const int j : near.of(i))
      if (marks[j] == Mark::Free && is_near(i, j)) marks[j] = Mark::Out;
  }
  return kept;
}

}  // namespace

DenseVector spacings(const Cloud& cloud) {
  const double power = 1.0 / cloud.dimension();
  return cloud.volumes().unaryExpr([power](double v) { return std::pow(v, power); });
}

std::vector<int> thin(const Cloud& cloud, const DenseVector& spacings, const Neighbours& near,
                      const std::vector<char>& left_out) {
  return dispatch(cloud.dimension(), [&](auto d) {
    return thin<decltype(d)::value>(cloud, spacings, near, left_out);
  });
}

}  // namespace gradpsi
