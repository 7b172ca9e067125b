#pragma once

#include "base/cpu.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/operator.hpp"

namespace gradpsi {

/// @throws InvalidInput  unless there is one wavelength or n, each > 0 and finite, and 1 / L^order within the range
///   of a double
void check_wavelengths(int order, int n, const VectorView& wavelengths);

/// certified_errors(), but bounds of rows that miss the tolerance beyond doubt, as norms of their moments tell, are
/// these norms. 0: everywhere to the end.
/// @param processor  one of runnable_cpus()
DenseVector bounded_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                           const VectorView& wavelengths, double tolerance, int threads,
                           const Cpu& processor = cpu());

}  // namespace gradpsi
