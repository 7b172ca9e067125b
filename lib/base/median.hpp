#pragma once

#include <algorithm>

#include "gradpsi/dense.hpp"

namespace gradpsi {

/// The median of at least one value; of an even number of them the mean of the middle two.
inline double median(DenseVector values) {
  double* const middle = values.data() + values.size() / 2;
  std::nth_element(values.data(), middle, values.data() + values.size());
  if (values.size() % 2 == 1) return *middle;
  return (*std::max_element(values.data(), middle) + *middle) / 2;
}

}  // namespace gradpsi
