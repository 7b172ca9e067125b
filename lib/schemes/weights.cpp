#include "schemes/weights.hpp"

#include <array>

namespace gradpsi {
namespace {

// In the order of Weight.
constexpr std::array<WeightRow, 7> table = {{
    {"direct", "(-W'/r)", "(W'' + (d-1) W'/r)",
     [](int order, int d) {
       return order == 1 ? Phi{.dw_over_q = -1} : Phi{.dw_over_q = d - 1.0, .d2w = 1};
     },
     2},
    {"diffuse", "(d W/r^2)", "(2d W/r^2)",
     [](int order, int d) { return Phi{.w_over_q2 = 1.0 * order * d}; }, 2},
    {"diffuse-ns", "(W/r)", "(2 W/r)", [](int order, int) { return Phi{.w_over_q = 1.0 * order}; },
     1},
    {"mixed", "", "(-2 W'/r)", [](int, int) { return Phi{.dw_over_q = -2}; }, 2},
    {"kernel", "W", "W", [](int, int) { return Phi{.w = 1}; }, 0},
    {"distance", "", "", [](int, int) { return Phi{}; }, 0},
    {"derivatives", "", "", [](int, int) { return Phi{.constant = 1}; }, 0},
}};

}  // namespace

const WeightRow& weight_row(Weight weight) { return table.at(static_cast<std::size_t>(weight)); }

std::string_view name(Weight weight) { return weight_row(weight).name; }

}  // namespace gradpsi
