#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "base/text.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/error.hpp"

namespace gradpsi {
namespace {

/// Moves points towards the centre by s(rho) = (1 + rho (g - 1)) / g, rho being the part of the way to the
/// faces they are at, and multiplies their volumes by the determinant, s^(d-1) d(rho s)/d rho.
void grade(const Lattice& lattice, Positions& x, DenseVector& volumes) {
  const double centre = (lattice.lower + lattice.upper) / 2, g = lattice.grading;
  const double half = (lattice.upper - lattice.lower) / 2;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double rho = (x.row(i).array() - centre).abs().maxCoeff() / half;
    const double s = (1 + rho * (g - 1)) / g;
    x.row(i) = (centre + (x.row(i).array() - centre) * s).eval();
    volumes[i] *= std::pow(s, lattice.dimension - 1) * (1 + 2 * rho * (g - 1)) / g;
  }
}

}  // namespace

Cloud make_cloud(const Lattice& lattice) {
  const int d = lattice.dimension;
  const int m = lattice.points_per_side;
  if (d < 1 || d > 3) throw InvalidInput("dimension must be 1, 2 or 3, not " + std::to_string(d));
  if (m < 1 || std::pow(m, d) > std::numeric_limits<int>::max() - 1)
    throw InvalidInput("points_per_side is " + std::to_string(m) +
                       "; there must be 1 to 2^31 - 2 points");
  const double dx = (lattice.upper - lattice.lower) / m;
  if (!(dx > 0 && std::isfinite(dx)))
    throw InvalidInput("upper must be greater than lower, both finite");
  if (!(lattice.jitter >= 0 && std::isfinite(lattice.jitter)))
    throw InvalidInput("jitter must be >= 0 and finite, not " + shortest(lattice.jitter));
  if (lattice.periodic && lattice.lower != 0)
    throw InvalidInput("a periodic box starts at the origin: lower must be 0");
  if (!(lattice.grading >= 1 && std::isfinite(lattice.grading)) ||
      (lattice.periodic && lattice.grading != 1))
    throw InvalidInput("grading must be >= 1 and finite, 1 in a periodic box, not " +
                       shortest(lattice.grading));

  // The standard fixes this generator's numbers, but not those of its distributions.
  std::mt19937_64 generator(lattice.seed);
  const auto symmetric_uniform = [&] {
    return std::ldexp(static_cast<double>(generator() >> 11), -52) - 1;
  };
  int n = 1;
  for (int a = 0; a < d; ++a) n *= m;
  Positions x(n, d);
  for (int i = 0; i < n; ++i)
    for (int a = d - 1, rest = i; a >= 0; --a, rest /= m)
      x(i, a) =
          lattice.lower +
          (rest % m + 0.5 + (lattice.jitter > 0 ? lattice.jitter * symmetric_uniform() : 0)) * dx;

  CloudOptions options{.volumes = DenseVector::Constant(n, std::pow(dx, d))};
  if (lattice.grading > 1) grade(lattice, x, options.volumes);
  if (lattice.periodic) std::fill_n(options.box.begin(), d, lattice.upper);
  return Cloud(std::move(x), std::move(options));
}

}  // namespace gradpsi
