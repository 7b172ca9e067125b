// Laws that hold for any points, scheme, kernel and support, tried on random ones. A failure prints the
// seed of its case and what was drawn with it; with_seed() alone then repeats it.

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "clouds.hpp"
#include "oracle.hpp"

namespace gradpsi {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

/// Coordinates are multiples of this part of the spacing, so that the cloud can be moved by 2^31 spacings
/// and in multiples of it without rounding.
constexpr double grain = 0x1p-20;

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(generator_() >> 11), -53);
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  int below(int n) { return static_cast<int>(generator_() % static_cast<unsigned>(n)); }
  bool chance(double share) { return between(0, 1) < share; }
  std::vector<int> permutation(int n) {
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    std::ranges::shuffle(order, generator_);
    return order;
  }

 private:
  std::mt19937_64 generator_;
};

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

struct Case {
  std::string description;
  Scheme scheme;
  AssemblyOptions options;
  Cloud cloud;
  Eigen::VectorXd supports;
  double translation;  // without rounding
  double unit;         // of length, a power of two
  bool ordinary_unit;

  int size() const { return cloud.size(); }
  int dimension() const { return cloud.dimension(); }
  bool gradient() const { return scheme.derivative == Derivative::Gradient; }
  bool positive() const { return scheme.consistency == Consistency::Positive; }
  /// Entries are 1 / length to this power.
  int power() const {
    // diffuse-ns without correction lacks one power of length: the paper's scheme, kept literally.
    const bool lacks = scheme.weight == Weight::DiffuseNs && scheme.consistency == Consistency::Zoc;
    return (gradient() ? 1 : 2) - (lacks ? 1 : 0);
  }
  CloudOptions cloud_options() const { return {.volumes = cloud.volumes(), .box = cloud.box()}; }
  Operator assembled(const Cloud& points, const Eigen::VectorXd& h) const {
    return assemble(scheme, points, find_neighbours(points, h), options);
  }
  /// r_ij / h_i.
  Eigen::VectorXd displacement(int i, int j, double h) const {
    Eigen::VectorXd r = cloud.positions().row(j) - cloud.positions().row(i);
    for (int a = 0; a < dimension(); ++a)
      if (cloud.box()[a] > 0) r[a] = std::remainder(r[a], cloud.box()[a]);
    return r / h;
  }
};

/// Large clouds are for several threads, with schemes that are quickly computed.
Case with_seed(std::uint64_t seed, int d, bool large = false) {
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

/// The largest of many ratios of error to tolerance, and where it is.
struct Worst {
  double ratio = 0;
  int row = -1;
  void add(double error, double tolerance, int i) {
    const double r = error <= tolerance * 1e300 ? error / tolerance : 1e300;  // NaN, too
    if (error > 0 || std::isnan(error))
      if (!(r <= ratio)) ratio = r, row = i;
  }
};
#define EXPECT_WITHIN(worst) EXPECT_LE((worst).ratio, 1) << "in row " << (worst).row

using Dense = std::vector<Eigen::MatrixXd>;
Dense dense(const Operator& op) { return {op.axes.begin(), op.axes.end()}; }

/// The reciprocal condition number that the rounding of row i goes with; 0: nothing can be expected.
double reciprocal_condition(const Operator& op, int i) {
  if (op.rows.degree[i] <= 0) return 1;  // zoc or zero
  if (op.rows.outcome[i] == RowOutcome::Lowered)
    return 0;  // that of the lower system is not reported
  return op.rows.reciprocal_condition[i];
}

/// 1 - q of the neighbour nearest to point i: near the edge of the support, weights are what rounding leaves
/// of (1 - q)^n. 1 without neighbours.
double inside(const Case& c, const Operator& op, int i) {
  double nearest = 1;
  for (SparseMatrix::InnerIterator entry(op.matrix(), i); entry; ++entry)
    if (entry.col() != i)
      nearest = std::min(
          nearest, c.displacement(i, static_cast<int>(entry.col()), op.rows.supports[i]).norm());
  return nearest < 1 ? 1 - nearest : 1;
}

/// That the operators, on the same points seen in another way, agree up to rounding. So near to singular
/// that it matters for a row's outcome, anything may happen.
/// @param lost  how much larger the rounding of the points is than that of a product
void expect_same(const Case& c, const Operator& a, const Dense& expected, const Operator& b,
                 const Dense& found, double lost) {
  Worst worst;
  int outcomes = 0;
  for (int i = 0; i < c.size(); ++i) {
    const double rcond = reciprocal_condition(a, i);
    if (a.rows.degree[i] != b.rows.degree[i] ||
        std::abs(a.rows.supports[i] / b.rows.supports[i] - 1) > 1e-6) {
      const double least = std::min(a.rows.reciprocal_condition[i], b.rows.reciprocal_condition[i]);
      outcomes += least > 1e-11 * lost;
      continue;
    }
    const double edge = inside(c, a, i);
    for (std::size_t axis = 0; axis < expected.size(); ++axis) {
      const double size = expected[axis].row(i).cwiseAbs().sum();
      const double error = (expected[axis].row(i) - found[axis].row(i)).cwiseAbs().maxCoeff();
      if (rcond > 0) worst.add(error, 30 * eps * lost / (rcond * edge) * size, i);
    }
  }
  EXPECT_WITHIN(worst);
  EXPECT_EQ(outcomes, 0);
}

/// .. to the last bit, rows of `b` being times `factor`.
void expect_identical(const Operator& a, const Operator& b, double factor = 1) {
  EXPECT_EQ(a.rows.outcome, b.rows.outcome);
  EXPECT_EQ(a.rows.reciprocal_condition, b.rows.reciprocal_condition);
  for (std::size_t axis = 0; axis < a.axes.size(); ++axis) {
    ASSERT_EQ(a.axes[axis].nonZeros(), b.axes[axis].nonZeros());
    const auto n = a.axes[axis].nonZeros();
    EXPECT_TRUE(std::equal(a.axes[axis].innerIndexPtr(), a.axes[axis].innerIndexPtr() + n,
                           b.axes[axis].innerIndexPtr()));
    EXPECT_EQ((a.axes[axis].coeffs() * factor - b.axes[axis].coeffs()).abs().maxCoeff(), 0);
  }
}

void neighbours_are_within_the_support(const Case& c, const Neighbours& near) {
  for (int i = 0; i < c.size(); ++i) {
    const double h = near.support(i);
    std::vector<char> listed(c.size());
    for (const int j : near.of(i)) listed[j] = true;
    for (int j = 0; j < c.size(); ++j) {
      const double q = c.displacement(i, j, h).norm();
      if (std::abs(q - 1) > 4 * eps) {
        ASSERT_EQ(static_cast<bool>(listed[j]), j != i && q < 1) << i << " " << j;
      }
    }
  }
}

void rows_are_finite_and_sum_to_zero(const Operator& op) {
  Worst worst;
  for (const SparseMatrix& matrix : op.axes) {
    EXPECT_TRUE(matrix.coeffs().isFinite().all());
    for (int i = 0; i < matrix.rows(); ++i) {
      const Eigen::RowVectorXd row = matrix.row(i);
      worst.add(std::abs(row.sum()), eps * row.size() * row.cwiseAbs().sum(), i);
    }
  }
  EXPECT_WITHIN(worst);
}

void degrees_are_those_asked_for(const Case& c, const Operator& op) {
  for (int i = 0; i < c.size(); ++i) {
    const RowOutcome outcome = op.rows.outcome[i];
    const bool whole = outcome == RowOutcome::AsAsked || outcome == RowOutcome::Widened;
    const double h = c.supports[c.supports.size() > 1 ? i : 0];
    if (outcome == RowOutcome::Widened) {
      EXPECT_GT(op.rows.supports[i], h);
      EXPECT_LE(op.rows.supports[i], widest * h);
    } else {
      EXPECT_EQ(op.rows.supports[i], h);
    }
    if (whole) {
      EXPECT_EQ(op.rows.degree[i], degree(c.scheme));
    } else if (outcome == RowOutcome::Lowered) {
      EXPECT_LT(op.rows.degree[i], degree(c.scheme));
      EXPECT_GE(op.rows.degree[i], 0);
    } else {
      EXPECT_EQ(op.rows.degree[i], -1);
      for (const SparseMatrix& matrix : op.axes) EXPECT_EQ(matrix.row(i).norm(), 0);
    }
  }
}

std::vector<std::array<int, 3>> exponents(int d, int most) {
  std::vector<std::array<int, 3>> all;
  for (int k = 0; k <= most; ++k)
    for (int l = 0; l <= (d > 1 ? most - k : 0); ++l)
      for (int m = 0; m <= (d > 2 ? most - k - l : 0); ++m)
        if (k + l + m > 0) all.push_back({k, l, m});
  return all;
}

/// In units of the support, where |s| < 1.
void conditions_are_met(const Case& c, const Operator& op) {
  Worst worst;
  const int d = c.dimension();
  for (int i = 0; i < c.size(); ++i) {
    const auto monomials = exponents(d, std::max(op.rows.degree[i], 0));
    const double h = op.rows.supports[i], rcond = reciprocal_condition(op, i);
    if (rcond == 0) continue;
    for (std::size_t axis = 0; axis < op.axes.size() && !monomials.empty(); ++axis) {
      std::vector<double> moments(monomials.size());
      double size = 0;
      for (SparseMatrix::InnerIterator entry(op.axes[axis], i); entry; ++entry) {
        const Eigen::VectorXd s = c.displacement(i, static_cast<int>(entry.col()), h);
        const double a = entry.value() * h * (c.gradient() ? 1 : h);
        size += std::abs(a);
        std::array<std::array<double, 7>, 3> powers;
        for (int b = 0; b < d; ++b) {
          powers[b][0] = 1;
          for (int k = 1; k < 7; ++k) powers[b][k] = powers[b][k - 1] * s[b];
        }
        for (std::size_t m = 0; m < monomials.size(); ++m) {
          double product = a;
          for (int b = 0; b < d; ++b) product *= powers[b][monomials[m][b]];
          moments[m] += product;
        }
      }
      for (std::size_t m = 0; m < monomials.size(); ++m) {
        const auto& k = monomials[m];
        const int total = k[0] + k[1] + k[2];
        const double target = c.gradient() ? total == 1 && k[axis] == 1
                                           : 2 * (total == 2 && std::ranges::max(k) == 2);
        worst.add(std::abs(moments[m] - target), 30 * eps / rcond * size, i);
      }
    }
  }
  EXPECT_WITHIN(worst);
}

void a_few_rows_agree_with_the_literal_formula(const Case& c, const Operator& op, Random& random) {
  if (degree(c.scheme) > 2 || c.positive() || !c.ordinary_unit) return;
  const Cloud cloud(c.cloud.positions(), {.volumes = op.volumes, .box = c.cloud.box()});
  for (int k = 0; k < 3; ++k) {
    const int i = random.below(c.size());
    if (op.rows.outcome[i] != RowOutcome::AsAsked) continue;
    const OracleRow row = oracle_row(c.scheme, cloud, op.rows.supports[i], i, c.options.kernel);
    Worst worst;
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
      const Eigen::RowVectorXd expected = row.weights.row(static_cast<Eigen::Index>(axis));
      worst.add((expected - Eigen::RowVectorXd(op.axes[axis].row(i))).cwiseAbs().maxCoeff(),
                30 * eps / row.reciprocal_condition * expected.cwiseAbs().sum(), i);
    }
    EXPECT_WITHIN(worst);
  }
}

void weights_have_the_symmetry_promised(const Case& c, const Operator& op) {
  const Symmetry promised = symmetry(c.scheme);
  if (promised == Symmetry::None || c.supports.size() > 1 || op.rows.degenerate() > 0) return;
  const double sign = promised == Symmetry::Symmetric ? 1 : -1;
  Worst worst;
  for (const Eigen::MatrixXd& matrix : dense(op))
    for (int i = 0; i < c.size(); ++i)
      for (int j = 0; j < i; ++j) {
        const double a = op.volumes[i] / c.unit * matrix(i, j),
                     b = op.volumes[j] / c.unit * matrix(j, i);
        worst.add(std::abs(a - sign * b), 30 * eps * (std::abs(a) + std::abs(b)), i);
      }
  EXPECT_WITHIN(worst);
}

void positive_stencils_are(const Case& c, const Operator& op) {
  if (!c.positive()) return;
  for (int i = 0; i < c.size(); ++i) {
    if (op.rows.degree[i] < 2) continue;
    EXPECT_LE(op.matrix().row(i).nonZeros(), unknowns(c.scheme, c.dimension()) + 1);
    for (SparseMatrix::InnerIterator a(op.matrix(), i); a; ++a)
      EXPECT_EQ(a.value() > 0, a.col() != i) << i;
  }
}

void a_translation_changes_nothing(const Case& c, const Operator& op) {
  SCOPED_TRACE(__func__);
  const Positions x = c.cloud.positions().array() + c.translation;
  expect_identical(op, c.assembled(Cloud(x, c.cloud_options()), c.supports));
}

void the_unit_of_length_enters_as_a_power(const Case& c, const Operator& op, Random& random) {
  SCOPED_TRACE(__func__);
  if (c.scheme.weight == Weight::DiffuseNs && c.options.on_degenerate == OnDegenerate::Lower)
    return;  // some rows lack a power of length, others do not
  const double unit = std::ldexp(1.0, random.below(61) - 30);
  CloudOptions options = c.cloud_options();
  for (int a = 0; a < c.dimension() && options.volumes.size() > 0; ++a) options.volumes *= unit;
  for (double& length : options.box) length *= unit;
  expect_identical(op, c.assembled(Cloud(c.cloud.positions() * unit, options), c.supports * unit),
                   std::pow(unit, -c.power()));
}

void permuted_points_permute_the_matrix(const Case& c, const Operator& op, Random& random) {
  SCOPED_TRACE(__func__);
  const std::vector<int> order = random.permutation(c.size());
  CloudOptions options = c.cloud_options();
  if (c.cloud.has_volumes()) options.volumes = Eigen::VectorXd(options.volumes(order));
  const Eigen::VectorXd supports =
      c.supports.size() > 1 ? Eigen::VectorXd(c.supports(order)) : c.supports;
  const Operator other =
      c.assembled(Cloud(c.cloud.positions()(order, Eigen::all), options), supports);
  std::vector<int> back(order.size());
  for (int k = 0; k < c.size(); ++k) back[order[k]] = k;
  Operator restored = other;
  restored.rows.degree = other.rows.degree(back).eval();
  restored.rows.supports = other.rows.supports(back).eval();
  restored.rows.reciprocal_condition = other.rows.reciprocal_condition(back).eval();
  Dense matrices = dense(other);
  for (Eigen::MatrixXd& matrix : matrices) matrix = Eigen::MatrixXd(matrix(back, back));
  expect_same(c, op, dense(op), restored, matrices, 1);
}

/// The least sum (r/h)^5 psi, h^2, which a positive stencil has in common with its image, be it another
/// one where several are as good.
Eigen::VectorXd costs(const Case& c, const Operator& op) {
  Eigen::VectorXd cost = Eigen::VectorXd::Zero(c.size());
  for (int i = 0; i < c.size(); ++i)
    for (SparseMatrix::InnerIterator a(op.matrix(), i); a; ++a) {
      const double h = op.rows.supports[i];
      cost[i] +=
          std::pow(c.displacement(i, static_cast<int>(a.col()), h).norm(), 5) * a.value() * h * h;
    }
  return cost;
}

void a_rotation_turns_the_gradient(const Case& c, const Operator& op, const Eigen::MatrixXd& R,
                                   double lost) {
  SCOPED_TRACE(__func__);
  CloudOptions options = c.cloud_options();
  for (int a = 0; a < c.dimension(); ++a) {  // quarter turns in boxes
    Eigen::Index from;
    R.row(a).cwiseAbs().maxCoeff(&from);
    options.box[a] = c.cloud.box()[from];
  }
  const Cloud turned_cloud(c.cloud.positions() * R.transpose(), options);
  const Operator turned = c.assembled(turned_cloud, c.supports);
  if (c.positive()) {
    const Eigen::VectorXd a = costs(c, op);
    Case other = c;
    other.cloud = turned_cloud;
    const Eigen::VectorXd b = costs(other, turned);
    Worst worst;
    for (int i = 0; i < c.size(); ++i)  // rounding may tip whether a row has to be widened
      if (op.rows.degree[i] == 2 && turned.rows.degree[i] == 2 &&
          op.rows.supports[i] == turned.rows.supports[i])
        worst.add(std::abs(a[i] - b[i]), 30 * eps * lost / op.rows.reciprocal_condition[i] * a[i],
                  i);
    EXPECT_WITHIN(worst);
    return;
  }
  Dense expected = dense(op);
  if (c.gradient())
    for (std::size_t a = 0; a < expected.size(); ++a) {
      expected[a].setZero();
      for (int b = 0; b < c.dimension(); ++b)
        expected[a] += R(static_cast<int>(a), b) * Eigen::MatrixXd(op.axes[b]);
    }
  expect_same(c, op, expected, turned, dense(turned), lost);
}

void rotations_turn_the_gradient(const Case& c, const Operator& op, Random& random) {
  const int d = c.dimension();
  if (d == 1) return;
  Eigen::MatrixXd quarter = Eigen::MatrixXd::Zero(d, d);
  const int axis = random.below(d), other = (axis + 1) % d;
  quarter.diagonal().setOnes();
  quarter(axis, axis) = quarter(other, other) = 0;
  quarter(axis, other) = -1;
  quarter(other, axis) = 1;
  a_rotation_turns_the_gradient(c, op, quarter, 1);
  if (c.cloud.box() != std::array<double, 3>{0, 0, 0}) return;
  Eigen::Matrix3d R =
      Eigen::AngleAxisd(random.between(-3, 3), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  if (d == 3)
    R = Eigen::AngleAxisd(random.between(-3, 3), Eigen::Vector3d(1, 2, -1).normalized()) * R;
  // Coordinates are rounded anew, and so are distances.
  const double extent = c.cloud.positions().cwiseAbs().maxCoeff();
  const double lost = 1 + extent / nearest_distances(c.cloud).minCoeff();
  a_rotation_turns_the_gradient(c, op, R.topLeftCorner(d, d), lost);
}

void threads_do_not_matter(const Case& c, const Operator& op, const Neighbours& near) {
  SCOPED_TRACE(__func__);
  Case other = c;
  for (const int threads : {1, 3}) {
    other.options.threads = threads;
    const Neighbours again = find_neighbours(c.cloud, c.supports, threads);
    EXPECT_EQ(again.offsets, near.offsets);
    EXPECT_EQ(again.indices, near.indices);
    expect_identical(op, assemble(c.scheme, c.cloud, again, other.options));
  }
}

void a_subset_of_rows_equals_rows_of_the_whole(const Case& c, const Operator& op,
                                               const Neighbours& near, Random& random) {
  AssemblyOptions options = c.options;
  options.rows.emplace(7);
  for (int& row : *options.rows) row = random.below(c.size());
  const Operator part = assemble(c.scheme, c.cloud, near, options);
  for (int k = 0; k < 7; ++k) {
    const int i = (*options.rows)[k];
    EXPECT_EQ(part.rows.outcome[k], op.rows.outcome[i]);
    EXPECT_EQ(part.rows.degree[k], op.rows.degree[i]);
    EXPECT_EQ(part.rows.supports[k], op.rows.supports[i]);
    EXPECT_EQ(part.rows.neighbours[k], op.rows.neighbours[i]);
    EXPECT_EQ(part.rows.reciprocal_condition[k], op.rows.reciprocal_condition[i]);
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
      EXPECT_EQ(Eigen::RowVectorXd(part.axes[axis].row(k)),
                Eigen::RowVectorXd(op.axes[axis].row(i)));
  }
}

Scheme another(const Case& c, Random& random) {
  for (;;)
    if (const Scheme scheme = schemes()[random.below(static_cast<int>(schemes().size()))];
        scheme.derivative == c.scheme.derivative && degree(scheme) <= 3 &&
        scheme.consistency != Consistency::Positive)
      return scheme;
}

void reassembling_equals_assembling(const Case& c, const Operator& op, const Neighbours& near,
                                    Random& random) {
  SCOPED_TRACE(__func__);
  if (c.positive() || c.options.on_degenerate == OnDegenerate::Widen) return;
  Operator again = assemble(another(c, random), c.cloud, near, c.options);
  reassemble(c.scheme, c.cloud, near, again, c.options);
  expect_identical(op, again);
}

void several_in_one_pass_equal_one_by_one(const Case& c, const Operator& op, const Neighbours& near,
                                          Random& random) {
  SCOPED_TRACE(__func__);
  const Scheme other = another(c, random);
  Scheme twin = c.scheme;  // of the other derivative, which shares its system if there is one
  twin.derivative = c.gradient() ? Derivative::Laplacian : Derivative::Gradient;
  std::vector<Scheme> together = {other, c.scheme};
  if (std::ranges::find(schemes(), twin) != schemes().end())
    together.insert(together.begin(), twin);
  const auto all = assemble(together, c.cloud, near, c.options);
  expect_same(c, op, dense(op), all.back(), dense(all.back()), 1);
  EXPECT_EQ(op.rows.outcome, all.back().rows.outcome);
}

void check(const Case& c, Random& random) {
  const Neighbours near = find_neighbours(c.cloud, c.supports);
  const Operator op = assemble(c.scheme, c.cloud, near, c.options);
  rows_are_finite_and_sum_to_zero(op);
  degrees_are_those_asked_for(c, op);
  conditions_are_met(c, op);
  a_few_rows_agree_with_the_literal_formula(c, op, random);
  weights_have_the_symmetry_promised(c, op);
  positive_stencils_are(c, op);
  a_subset_of_rows_equals_rows_of_the_whole(c, op, near, random);
  reassembling_equals_assembling(c, op, near, random);
  if (c.size() > 1000) return threads_do_not_matter(c, op, near);
  neighbours_are_within_the_support(c, near);
  a_translation_changes_nothing(c, op);
  the_unit_of_length_enters_as_a_power(c, op, random);
  permuted_points_permute_the_matrix(c, op, random);
  rotations_turn_the_gradient(c, op, random);
  several_in_one_pass_equal_one_by_one(c, op, near, random);
}

class Properties : public testing::TestWithParam<int> {};

TEST_P(Properties, HoldForAnyPointsSchemeKernelAndSupport) {
  const int d = GetParam(), cases = d == 3 ? 60 : 150;
  for (int k = 0; k < cases; ++k) {
    const std::uint64_t seed = 100'000 * d + k;
    const Case c = with_seed(seed, d, k % 20 == 19);
    SCOPED_TRACE(c.description);
    Random random(seed + 1'000'000);
    try {
      check(c, random);
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Dimensions, Properties, testing::Values(1, 2, 3),
                         [](const auto& dimension) {
                           return std::to_string(dimension.param) + "d";
                         });

}  // namespace
}  // namespace gradpsi
