#pragma once

#include <string_view>

#include "gradpsi/scheme.hpp"
#include "schemes/forms.hpp"

namespace gradpsi {

/// A row of the table of weights, Tables I and II: phi(r) of first and second derivatives.
struct WeightRow {
  std::string_view name;
  std::string_view first, second;        // phi(r) in plain text; empty: there is none
  Phi (*phi)(int order, int dimension);  // of first and second derivatives
  int lacks;                             // powers of 1/h that weights without correction lack
};

/// The weight's row.
const WeightRow& weight_row(Weight weight);

}  // namespace gradpsi
