#include "studies/converge_summary.hpp"

#include <algorithm>
#include <cmath>

#include "common/columns.hpp"
#include "studies/claims.hpp"

namespace gradpsi::apps::converge {

namespace {

/// An order with two decimals, without a sign on zero.
std::string order_text(double order) { return cell(std::abs(order) < 0.005 ? 0.0 : order, "%.2f"); }

/// The curves of one scheme: three supports on regular points, three on irregular ones.
using Line = std::span<const Curve>;

std::string order_table(const std::vector<Curve>& all, const std::string& points, Error error) {
  constexpr int name_width = 24, column_width = 8, arrangements = 2;
  constexpr std::size_t columns_of_orders = arrangements * support_ratios.size();
  Columns<Line> columns = {
      {"", [](Line line) { return name(line.front().front().scheme); }, {.width = -name_width}}};
  for (std::size_t k = 0; k < columns_of_orders; ++k)
    columns.push_back({cell(support_ratios[k % support_ratios.size()], "%.1f"),
                       [=](Line line) { return order_text(fitted_order(line[k], error)); },
                       {.width = column_width}});
  std::vector<Line> lines;
  for (std::size_t k = 0; k < all.size(); k += columns_of_orders)
    lines.push_back(Line(all).subspan(k, columns_of_orders));
  const Curve fitted = fitted_part(all.front());
  return "Fitted order of the L2 error over " + points + ", spacings " +
         cell(fitted.front().spacing, "%.2g") + " to " + cell(fitted.back().spacing, "%.2g") +
         ":\n\n" + padded("regular, h/dx", name_width + 3 * column_width) +
         padded("irregular, h/dx", 3 * column_width) + '\n' + text_table(columns, lines) + '\n';
}

/// A conclusion of the paper: the orders measured and accepted, and whether they agree.
struct Conclusion {
  std::string text, measured, accepted, observed;
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

std::string conclusion_table(const std::vector<Curve>& all, Error error) {
  std::vector<Conclusion> conclusions;
  for (const Claim& claim : claims()) {
    const Observation seen = observation(claim, all, error);
    conclusions.push_back(
        {std::string(claim.text), order_text(seen.least) + " .. " + order_text(seen.most),
         std::isfinite(claim.least) ? cell(claim.least, "%.1f") + " .. " + cell(claim.most, "%.1f")
                                    : "at most " + cell(claim.most, "%.1f"),
         verdict(seen.observed, seen.of, seen.exceptions)});
  }
  const Rounding seen = rounding(all, error);
  conclusions.push_back({"soc, second: troubled at very small spacing",
                         "dx >= " + cell(seen.smallest, "%.1e"), "",
                         seen.reached() ? verdict(seen.risen, seen.of) : "not reached"});
  return text_table({{"", &Conclusion::text, {.width = -46}},
                     {"measured", &Conclusion::measured, {.width = 15}},
                     {"accepted", &Conclusion::accepted, {.width = 14}},
                     {"   observed", [](auto& c) { return "   " + c.observed; }}},
                    conclusions);
}

}  // namespace

std::string summary(const std::vector<Result>& results, int dimension) {
  const bool interior = dimension > 1;
  const Error error = interior ? &Result::interior_l2 : &Result::l2;
  const std::vector<Curve> all = curves(results);
  std::string out = order_table(all, "all points", &Result::l2);
  if (interior) out += order_table(all, "interior points (those in [-1/2, 1/2]^d)", error);
  out += std::string("The paper's conclusions, by the order over ") +
         (interior ? "interior" : "all") + " points:\n\n" + conclusion_table(all, error);
  const auto degenerate =
      std::ranges::count_if(results, [](auto& r) { return r.degenerate_rows > 0; });
  if (degenerate > 0)
    out += "\nIn " + std::to_string(degenerate) + " of " + std::to_string(results.size()) +
           " matrices rows had to be lowered to a consistency that could be solved.\n";
  return out;
}

}  // namespace gradpsi::apps::converge
