// gradpsi converge: the convergence study of the paper (its Figs. 1 and 2).
//
//     gradpsi converge --quick --out results
//
// differentiates u = 1 + cos(pi x) (in d dimensions 1 + the product of the cosines) on [-1, 1]^d
// with each of the seventeen schemes, three support ratios, on regular and jittered points of ever smaller spacing,
// with supports truncated at the boundary. Expect, in 1D: no convergence without correction, and
// second derivatives on irregular points that get worse; order 1 to 2 with first-, 2 with
// second-order consistency; and at spacings below 1e-4 the rounding of u, magnified by 1/dx^2, in
// the second ones.

#include "studies/converge.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "common/progress.hpp"
#include "common/study.hpp"
#include "studies/convergence_gp.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::Consistency;
using gradpsi::Derivative;
using gradpsi::Scheme;
using std::filesystem::path;

constexpr double pi = std::numbers::pi;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr std::array support_ratios = {2.5, 3.5, 4.5};
constexpr std::array<const char*, 2> arrangements = {"regular", "irregular"};
constexpr double irregular_jitter = 0.2;
constexpr std::uint64_t seed = 1;

/// Points per side of the successive clouds; [-1, 1] has length 2.
std::vector<int> sides(const ConvergeOptions& options) {
  static constexpr std::array quick_points = {20'000, 30'000, 25'000};
  static constexpr std::array full_points = {2'000'000, 500'000, 70'000};
  const int most = options.points_max.value_or(
      (options.quick ? quick_points : full_points)[options.dimension - 1]);
  std::vector<int> result;
  for (int k = 0;; ++k) {
    // 1D: spacings 1, 1/2, 1/5 of each power of ten; else a factor of sqrt(2).
    static constexpr std::array<int, 3> decade = {2, 4, 10};
    const double side = options.dimension == 1 ? decade[k % 3] * std::pow(10, k / 3 + 1)
                                               : std::round(10 * std::exp2(0.5 * (k + 1)));
    if (std::pow(side, options.dimension) > most) return result;
    result.push_back(static_cast<int>(side));
  }
}

/// One line of the CSV.
struct Result {
  Scheme scheme;
  int arrangement;
  double support_ratio;
  int points;
  double spacing;
  double l2, max;                    // over all points
  double interior_l2, interior_max;  // over [-1/2, 1/2]^d; NaN if supports there are truncated
  int degenerate_rows;
};

bool same_curve(const Result& a, const Result& b) {
  return a.scheme == b.scheme && a.arrangement == b.arrangement &&
         a.support_ratio == b.support_ratio;
}

/// The field and its derivatives at the points: n values, n x d, n values.
struct Exact {
  Eigen::VectorXd u;
  Eigen::MatrixXd gradient;
  Eigen::VectorXd laplacian;
};

Exact exact(const gradpsi::Positions& x) {
  const Eigen::ArrayXXd c = (pi * x.array()).cos();
  const Eigen::ArrayXXd s = (pi * x.array()).sin();
  const Eigen::ArrayXd product = c.rowwise().prod();
  Exact result{1 + product, Eigen::MatrixXd(x.rows(), x.cols()),
               -pi * pi * static_cast<double>(x.cols()) * product};
  for (Eigen::Index a = 0; a < x.cols(); ++a) {
    Eigen::ArrayXXd factors = c;
    factors.col(a) = -pi * s.col(a);
    result.gradient.col(a) = factors.rowwise().prod();
  }
  return result;
}

/// Length of the error vector at each point.
Eigen::VectorXd errors(const Scheme& scheme, const gradpsi::Operator& op, const Exact& exact) {
  if (scheme.derivative == Derivative::Laplacian)
    return (op.matrix() * exact.u - exact.laplacian).cwiseAbs();
  Eigen::VectorXd squared = Eigen::VectorXd::Zero(exact.u.size());
  for (std::size_t a = 0; a < op.axes.size(); ++a)
    squared +=
        (op.axes[a] * exact.u - exact.gradient.col(static_cast<Eigen::Index>(a))).cwiseAbs2();
  return squared.cwiseSqrt();
}

void set_norms(Result& result, const Eigen::VectorXd& error, const gradpsi::Positions& x) {
  const auto norms = [&](double half_width) {
    double sum = 0, max = 0;
    int count = 0;
    for (Eigen::Index i = 0; i < error.size(); ++i) {
      if (x.row(i).cwiseAbs().maxCoeff() > half_width) continue;
      sum += error[i] * error[i];
      max = std::max(max, error[i]);
      ++count;
    }
    return std::pair(std::sqrt(sum / count), max);
  };
  std::tie(result.l2, result.max) = norms(2);  // jitter can reach beyond 1
  const bool whole_supports = result.support_ratio * result.spacing < 0.5;
  std::tie(result.interior_l2, result.interior_max) =
      whole_supports ? norms(0.5) : std::pair(not_a_number, not_a_number);
}

/// All results, curve by curve, each from the largest spacing to the smallest.
std::vector<Result> study(const ConvergeOptions& options) {
  const auto all_sides = sides(options);
  Progress progress(6 * static_cast<int>(all_sides.size()), "clouds and supports");
  int done = 0;
  std::vector<Result> results;
  for (const int m : all_sides) {
    for (int arrangement = 0; arrangement < 2; ++arrangement) {
      const gradpsi::Cloud cloud =
          make_cloud(gradpsi::Lattice{.dimension = options.dimension,
                                      .points_per_side = m,
                                      .lower = -1,
                                      .upper = 1,
                                      .jitter = arrangement == 0 ? 0 : irregular_jitter,
                                      .seed = seed});
      const Exact derivatives = exact(cloud.positions());
      for (const double ratio : support_ratios) {
        const auto near = find_neighbours(cloud, ratio * cloud.spacing(), options.threads);
        for (const Scheme& scheme : gradpsi::classified_schemes()) {
          const auto op =
              assemble(scheme, cloud, near,
                       {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = options.threads});
          Result result{scheme, arrangement, ratio, cloud.size(),        2.0 / m, 0,
                        0,      0,           0,     op.rows.degenerate()};
          set_norms(result, errors(scheme, op, derivatives), cloud.positions());
          results.push_back(result);
        }
        progress.show(++done);
      }
    }
  }
  const auto rank = [](const Scheme& s) {
    return std::ranges::find(gradpsi::classified_schemes(), s) -
           gradpsi::classified_schemes().begin();
  };
  std::ranges::stable_sort(results, {}, [&](const Result& r) {
    return std::tuple(rank(r.scheme), r.arrangement, r.support_ratio);
  });
  return results;
}

using Error = double Result::*;

/// An order with two decimals, without a sign on zero.
std::string order_text(double order) { return cell(std::abs(order) < 0.005 ? 0.0 : order, "%.2f"); }

/// Observed order between two spacings.
double order(const Result& coarse, const Result& fine, Error error) {
  return std::log(coarse.*error / fine.*error) / std::log(coarse.spacing / fine.spacing);
}

std::string csv(const std::vector<Result>& results, int dimension) {
  std::string out = "scheme,arrangement,support_ratio,points,spacing,error_l2,error_max,order";
  if (dimension > 1) out += ",interior_l2,interior_max,interior_order";
  for (std::size_t k = 0; k < results.size(); ++k) {
    const Result& r = results[k];
    const bool first = k == 0 || !same_curve(results[k - 1], r);
    const auto observed = [&](Error error) {
      return first ? "" : cell(order(results[k - 1], r, error), "%.4g");
    };
    out += '\n' + name(r.scheme) + ',' + arrangements[r.arrangement];
    for (const double x : {r.support_ratio, double(r.points), r.spacing, r.l2, r.max})
      out += ',' + cell(x);
    out += ',' + observed(&Result::l2);
    if (dimension > 1)
      out += ',' + cell(r.interior_l2) + ',' + cell(r.interior_max) + ',' +
             observed(&Result::interior_l2);
  }
  return out + '\n';
}

/// Slope of log(error) against log(spacing) by least squares.
double slope(std::span<const Result> curve, Error error) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const Result& r : curve) {
    const double lx = std::log(r.spacing), ly = std::log(r.*error);
    if (!std::isfinite(ly)) continue;
    n += 1, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
  }
  return n < 2 ? not_a_number : (n * xy - x * y) / (n * xx - x * x);
}

/// A curve's part between the coarsest clouds and the rounding of u: the finer half of its spacings
/// down to 1e-3, at least three.
std::span<const Result> fitted_part(std::span<const Result> curve) {
  const auto resolved = std::ranges::count_if(curve, [](auto& r) { return r.spacing > 0.99e-3; });
  const auto first =
      std::min<std::ptrdiff_t>(resolved / 2, std::max<std::ptrdiff_t>(resolved - 3, 0));
  return curve.subspan(first, resolved - first);
}

std::vector<std::span<const Result>> curves(const std::vector<Result>& results) {
  std::vector<std::span<const Result>> all;
  for (auto begin = results.begin(); begin != results.end();) {
    const auto end =
        std::find_if(begin, results.end(), [&](auto& r) { return !same_curve(r, *begin); });
    all.emplace_back(begin, end);
    begin = end;
  }
  return all;
}

/// A conclusion of the paper: curves it speaks of, and the range that their fitted order must lie
/// in. "No convergence" allows order 1/2: the L2 norm of an error that stays O(1) in a boundary
/// layer of width h falls that fast.
struct Claim {
  std::string_view text;
  Derivative derivative;
  Consistency consistency;
  int arrangement;
  double least, most;
};
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::array claims = {
    Claim{"zoc, first, regular: no convergence", Derivative::Gradient, Consistency::Zoc, 0,
          -infinity, 0.5},
    Claim{"zoc, first, irregular: no convergence", Derivative::Gradient, Consistency::Zoc, 1,
          -infinity, 0.5},
    Claim{"zoc, second, regular: no convergence", Derivative::Laplacian, Consistency::Zoc, 0,
          -infinity, 0.5},
    Claim{"zoc, second, irregular: the error grows", Derivative::Laplacian, Consistency::Zoc, 1,
          -infinity, -0.5},
    Claim{"foc, first, regular: order between 1 and 2", Derivative::Gradient, Consistency::Foc, 0,
          0.9, 2.1},
    Claim{"foc, first, irregular: order between 1 and 2", Derivative::Gradient, Consistency::Foc, 1,
          0.9, 2.1},
    Claim{"soc, first, regular: order 2", Derivative::Gradient, Consistency::Soc, 0, 1.8, 2.2},
    Claim{"soc, first, irregular: order 2", Derivative::Gradient, Consistency::Soc, 1, 1.8, 2.2},
    Claim{"soc, second, regular: order 2", Derivative::Laplacian, Consistency::Soc, 0, 1.8, 2.5},
    Claim{"soc, second, irregular: order 1", Derivative::Laplacian, Consistency::Soc, 1, 0.8, 1.5},
};

std::string verdict(int observed, int of, const std::set<std::string_view>& exceptions = {}) {
  std::string text = of == 0          ? "not measured"
                     : observed == of ? "yes"
                     : observed == 0  ? "no"
                                      : "partly";
  text += " (" + std::to_string(observed) + " of " + std::to_string(of) + " curves";
  if (observed > 0 && !exceptions.empty()) {
    text += "; exceptions:";
    for (const auto weight : exceptions) text += ' ' + std::string(weight);
  }
  return text + ")";
}

using Curves = std::vector<std::span<const Result>>;

std::string order_table(const Curves& all, const std::string& points, Error error) {
  constexpr int name_width = 24, column_width = 8;
  const auto fitted = fitted_part(all.front());
  std::string out = "Fitted order of the L2 error over " + points + ", spacings " +
                    cell(fitted.front().spacing, "%.2g") + " to " +
                    cell(fitted.back().spacing, "%.2g") + ":\n\n" +
                    padded("regular, h/dx", name_width + 3 * column_width) +
                    padded("irregular, h/dx", 3 * column_width) + '\n' + padded("", name_width);
  for (int column = 0; column < 6; ++column)
    out += padded(cell(support_ratios[column % 3], "%.1f"), column_width);
  for (const auto& curve : all) {
    const Result& r = curve.front();
    const std::string scheme = name(r.scheme);
    if (r.arrangement == 0 && r.support_ratio == support_ratios[0])
      out += '\n' + scheme + padded("", name_width - static_cast<int>(scheme.size()));
    out += padded(order_text(slope(fitted_part(curve), error)), column_width);
  }
  return out + "\n\n";
}

std::string claim_line(const Claim& claim, const Curves& all, Error error) {
  double least = infinity, most = -infinity;
  int observed = 0, count = 0;
  std::set<std::string_view> exceptions;  // weights
  for (const auto& curve : all) {
    const Result& r = curve.front();
    const double order = slope(fitted_part(curve), error);
    if (r.scheme.derivative != claim.derivative || r.scheme.consistency != claim.consistency ||
        r.arrangement != claim.arrangement || std::isnan(order))
      continue;
    least = std::min(least, order), most = std::max(most, order);
    ++count;
    if (order >= claim.least && order <= claim.most)
      ++observed;
    else
      exceptions.insert(name(r.scheme.weight));
  }
  return std::string(claim.text) + std::string(46 - claim.text.size(), ' ') +
         padded(order_text(least) + " .. " + order_text(most), 15) +
         padded(std::isfinite(claim.least)
                    ? cell(claim.least, "%.1f") + " .. " + cell(claim.most, "%.1f")
                    : "at most " + cell(claim.most, "%.1f"),
                14) +
         "   " + verdict(observed, count, exceptions) + '\n';
}

/// Rounding shows where the error of the smallest spacing is well above the curve's least.
std::string rounding_line(const Curves& all, Error error) {
  int risen = 0, count = 0;
  double smallest = infinity;
  for (const auto& curve : all) {
    const Scheme& s = curve.front().scheme;
    if (s.derivative != Derivative::Laplacian || s.consistency != Consistency::Soc) continue;
    double least = infinity;
    for (const Result& r : curve)
      if (r.*error < least) least = r.*error;  // false for NaN
    risen += curve.back().*error > 2 * least;
    smallest = std::min(smallest, curve.back().spacing);
    ++count;
  }
  const bool reached = risen > 0 || smallest < 1e-5;
  return "soc, second: troubled at very small spacing   " +
         padded("dx >= " + cell(smallest, "%.1e"), 15) + padded("", 14) + "   " +
         (reached ? verdict(risen, count) : "not reached") + '\n';
}

/// Fitted orders of every scheme and, claim by claim, whether the paper's conclusions were observed.
std::string summary(const std::vector<Result>& results, const ConvergeOptions& options) {
  const bool interior = options.dimension > 1;
  const Error error = interior ? &Result::interior_l2 : &Result::l2;
  const Curves all = curves(results);
  std::string out = order_table(all, "all points", &Result::l2);
  if (interior) out += order_table(all, "interior points (those in [-1/2, 1/2]^d)", error);
  out += std::string("The paper's conclusions, by the order over ") +
         (interior ? "interior" : "all") + " points:\n\n" + padded("measured", 61) +
         padded("accepted", 14) + "   observed\n";
  for (const Claim& claim : claims) out += claim_line(claim, all, error);
  out += rounding_line(all, error);
  const auto degenerate =
      std::ranges::count_if(results, [](auto& r) { return r.degenerate_rows > 0; });
  if (degenerate > 0)
    out += "\nIn " + std::to_string(degenerate) + " of " + std::to_string(results.size()) +
           " matrices rows had to be lowered to a consistency that could be solved.\n";
  return out;
}

}  // namespace

void converge(const ConvergeOptions& options) {
  static constexpr std::array smallest = {20, 196, 2744};
  if (options.points_max && sides(options).empty())
    throw gradpsi::InvalidInput(
        "--points-max " + std::to_string(*options.points_max) +
        " is less than the smallest cloud has: " + std::to_string(smallest[options.dimension - 1]));
  create_folder(options.out);
  const std::string suffix =
      options.dimension == 1 ? "" : "_" + std::to_string(options.dimension) + "d";
  const auto in_out = [&](const std::string& name) { return options.out / name; };

  const auto results = study(options);
  const std::string table = "convergence" + suffix + ".csv";
  gradpsi::write_text(in_out(table), csv(results, options.dimension));

  const std::string text = summary(results, options);
  gradpsi::write_text(
      in_out("convergence" + suffix + ".txt"),
      provenance(options.threads) + "# seed: " + std::to_string(seed) + "\n\n" + text);
  std::cout << text << std::flush;

  draw(in_out("convergence" + suffix + ".gp"),
       "csv = '" + table + "'\nsuffix = '" + suffix + "'\n" +
           (options.dimension == 1 ? "error_column = 6\nerror_name = 'L2 error'\n"
                                   : "error_column = 9\nerror_name = 'L2 error, interior'\n") +
           convergence_gp,
       in_out(table));
  std::cout << "\nResults: " << in_out(table).string()
            << "\nFigures: " << in_out("figure1" + suffix + ".png").string() << ", "
            << in_out("figure2" + suffix + ".png").string() << " (and .svg)\n";
}

}  // namespace gradpsi::apps
