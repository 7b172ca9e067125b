#include "pipeline/random_case.hpp"

#include <sstream>

namespace gradpsi {
namespace {

/// Coordinates are multiples of this part of the spacing, so that the cloud can be moved by 2^31 spacings
/// and in multiples of it without rounding.
constexpr double grain = 0x1p-20;

/// Coordinates in units of the spacing, about m^d points in [0, m]^d, and what they are called.
struct Arrangement {
  std::string name;
  Positions x;
  std::array<double, 3> stretch = {1, 1, 1};
};
Arrangement arrangement(Random& random, int d, int m) {
  Arrangement result{"lattice", make_cloud(Lattice{.dimension = d,
                                                   .points_per_side = m,
                                                   .upper = static_cast<double>(m),
                                                   .jitter = random.between(0.02, 0.45),
                                                   .seed = random.below(1 << 30) + 1ULL})
                                    .positions()};
  Positions& x = result.x;
  const auto scatter = [&](Eigen::Index first, Eigen::Index count, double low, double high) {
    for (Eigen::Index i = first; i < first + count; ++i)
      for (int a = 0; a < d; ++a) x(i, a) = random.between(low, high);
  };
  switch (random.below(4)) {
    case 0: break;
    case 1:
      result.name = "random";
      scatter(0, x.rows(), 0, m);
      break;
    case 2: {
      result.name = "clustered";
      const Eigen::Index half = x.rows() / 2, count = std::min<Eigen::Index>(half, 12);
      scatter(0, half, 0, m);
      for (Eigen::Index first = half; first < x.rows(); first += count) {
        const double width = random.log_between(0.05, 1), low = random.between(0, m - width);
        scatter(first, std::min(count, x.rows() - first), low, low + width);
      }
      break;
    }
    default:
      result.name = "stretched";
      for (int a = 1; a < d; ++a) result.stretch[a] = random.log_between(1, 1e3);
      for (int a = 0; a < d; ++a) x.col(a) *= result.stretch[a];
  }
  return result;
}

}  // namespace

RandomCase with_seed(std::uint64_t seed, int d, bool large) {
  Random random(seed);
  Scheme scheme = schemes()[random.below(static_cast<int>(schemes().size()))];
  // Of the two that take most of the time a quarter is enough.
  if (d == 3 && degree(scheme) > 4 && random.chance(0.75)) scheme = "laplacian-mixed-soc";
  if (large && degree(scheme) > 2) scheme = "gradient-ls-2";
  const int m = large    ? (d == 1   ? 1800
                            : d == 2 ? 42
                                     : 12)
                : d == 1 ? 12 + random.below(60)
                : d == 2 ? 5 + random.below(8)
                         : 4 + random.below(degree(scheme) > 4 ? 2 : 3);
  auto [name, x, stretch] = arrangement(random, d, m);
  x = (x / grain).array().round() * grain;
  Eigen::VectorXd volumes;
  if (random.chance(0.7)) {
    volumes.resize(x.rows());
    for (double& v : volumes) v = random.between(0.3, 3);
  }
  const double geometric = std::pow(stretch[0] * stretch[1] * stretch[2], 1.0 / d);
  CloudOptions
      options;  // periodic directions must have room for a support that reaches across the others
  if (random.chance(0.5))
    for (int a = 0; a < d; ++a)
      if (stretch[a] >= geometric && random.chance(0.7))
        options.box[a] = std::round(m * stretch[a] / grain) * grain;

  // The support in spacings, or what the scheme brings along; within half the box.
  const auto own = support_ratio(scheme);
  const double ratio = own && random.chance(0.6) ? *own : random.between(2, 4);
  double most = std::numeric_limits<double>::infinity();
  for (int a = 0; a < d; ++a)
    if (options.box[a] > 0) most = std::min(most, options.box[a] / 2);
  const double usual = Cloud(x, {.box = options.box}).spacing();
  Eigen::VectorXd supports(random.chance(0.6) ? 1 : x.rows());
  for (double& h : supports)
    h = std::min(most, ratio * std::max(usual, geometric) *
                           (supports.size() > 1 ? random.between(0.8, 1.25) : 1));

  const bool ordinary_unit = random.chance(0.6);
  const int widest_unit = d == 3 ? 310 : 332;
  const double unit =
      ordinary_unit ? 1 : std::ldexp(1.0, random.below(2 * widest_unit) - widest_unit);
  const double origin = random.chance(0.7) ? 0 : std::round(random.log_between(10, 2e9));
  const double translation = std::round(random.between(-1e3, 1e3) / grain) * grain * unit;
  x.array() += random.chance(0.5) ? origin : -origin;

  x *= unit;
  supports *= unit;
  for (double& length : options.box) length *= unit;
  if (volumes.size() > 0)
    for (int a = 0; a < d; ++a) volumes *= stretch[a] * unit;
  const std::vector<int> kept = distinct_points(Cloud(x, options));
  x = Positions(x(kept, Eigen::all));
  if (volumes.size() > 0) options.volumes = volumes(kept);
  if (supports.size() > 1) supports = Eigen::VectorXd(supports(kept));

  const auto policy = std::array{OnDegenerate::Lower, OnDegenerate::Widen, OnDegenerate::Zero};
  AssemblyOptions assembly{.kernel = kernels()[random.below(static_cast<int>(kernels().size()))],
                           .on_degenerate = policy[random.below(3)]};
  std::ostringstream description;
  description << "seed " << seed << (large ? ", large" : "") << ": " << gradpsi::name(scheme)
              << ", kernel " << assembly.kernel.name << ", " << x.rows() << " points in " << d
              << "D, " << name << " stretched by (" << stretch[0] << ", " << stretch[1] << ", "
              << stretch[2] << "), " << (volumes.size() > 0 ? "unequal" : "no")
              << " volumes, unit of length " << unit << ", origin " << origin
              << " units away, box (" << options.box[0] << ", " << options.box[1] << ", "
              << options.box[2] << "), " << supports.size() << " support(s) from " << supports[0]
              << " on, policy " << static_cast<int>(assembly.on_degenerate);
  return {description.str(), scheme,      assembly, Cloud(x, options),
          supports,          translation, unit,     ordinary_unit};
}

}  // namespace gradpsi
