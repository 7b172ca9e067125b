#pragma once

#include <Eigen/Core>
#include <functional>
#include <gradpsi/matrix.hpp>
#include <limits>
#include <string>

#include "common/timing.hpp"

// How fast a matrix is multiplied, by which means, beside the memory's own speed.

namespace gradpsi::apps::spmv {

/// How fast something was.
struct Measurement {
  std::string what;
  double ns_an_entry;  ///< NaN: it has none
  double bytes_a_second;
  double roof;  ///< bytes a second
};
/// Of the roof; NaN above it, where the memory was not what counts, or busy while the roof was measured.
inline double share(const Measurement& m) {
  const double share = m.bytes_a_second / m.roof;
  return share <= 1 ? share : std::numeric_limits<double>::quiet_NaN();
}
using Show = std::function<void(const Measurement&)>;

/// Measures, what memory can do first; each is shown as it comes.
/// @param symmetric  whether A is: then its upper triangle is multiplied, too
/// @return  the largest difference from Eigen's product, of sum |a| |x|
double measure(const SparseMatrix& A, bool symmetric, int threads, Timer& timer, const Show& show);

}  // namespace gradpsi::apps::spmv
