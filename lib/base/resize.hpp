#pragma once

#include <Eigen/Core>

namespace gradpsi {

/// x.resize(rows, columns), after which x can be destroyed even if memory has run out: Eigen's own frees
/// the old memory first, and if there is no new one, frees it once more in the destructor.
template <class Dense>
void resize(Dense& x, Eigen::Index rows, Eigen::Index columns = 1) {
  if (x.size() != rows * columns) x = Dense();
  x.resize(rows, columns);
}

}  // namespace gradpsi
