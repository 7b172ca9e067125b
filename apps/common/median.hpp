#pragma once

#include <algorithm>
#include <vector>

namespace gradpsi::apps {

/// The median of at least one value; of an even number of them the mean of the middle two.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return (*std::max_element(values.begin(), middle) + *middle) / 2;
}

}  // namespace gradpsi::apps
