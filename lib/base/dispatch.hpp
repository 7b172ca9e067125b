#pragma once

#include <type_traits>

namespace gradpsi {

/// Calls f with the run-time dimension as a compile-time constant.
template <class F>
auto dispatch(int dimension, const F& f) {
  switch (dimension) {
    case 1: return f(std::integral_constant<int, 1>{});
    case 2: return f(std::integral_constant<int, 2>{});
    default: return f(std::integral_constant<int, 3>{});
  }
}

}  // namespace gradpsi
