#include "petsc/vectors.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace gradpsi::petsc {
namespace {

/// A number from -1 to 1 for each row.
double noise(std::uint64_t number, std::uint64_t seed) {
  std::uint64_t x = number * 0x9E3779B97F4A7C15u + seed;  // Steele, Lea, Flood: splitmix64
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return std::ldexp(static_cast<double>((x ^ x >> 31) >> 11), -52) - 1;
}

/// Makes entries those of |A|.
void take_magnitudes(Mat A) {
  Mat own, others;
  check(MatMPIAIJGetSeqAIJ(A, &own, &others, nullptr));
  for (const Mat block : {own, others}) {
    MatInfo info;
    double* values;
    check(MatGetInfo(block, MAT_LOCAL, &info));
    check(MatSeqAIJGetArray(block, &values));
    std::transform(values, values + static_cast<std::ptrdiff_t>(info.nz_used), values,
                   [](double a) { return std::abs(a); });
    check(MatSeqAIJRestoreArray(block, &values));
  }
}

}  // namespace

bool is_symmetric(Mat A, const VectorView& scale) {
  const auto x = vector_like(A), y = vector_like(A), Ax = vector_like(A), Ay = vector_like(A);
  PetscInt first;
  check(VecGetOwnershipRange(x.get(), &first, nullptr));
  for_each_entry(x.get(), [&](PetscInt k, double& v) { v = noise(first + k, 1); });
  for_each_entry(y.get(), [&](PetscInt k, double& v) { v = noise(first + k, 2); });
  check(MatMult(A, x.get(), Ax.get()));
  check(MatMult(A, y.get(), Ay.get()));
  for (const Vec product : {Ax.get(), Ay.get()})
    for_each_entry(product, [&](PetscInt k, double& v) { v *= scale[k]; });
  double xAy, yAx, size, norm;
  check(VecDot(x.get(), Ay.get(), &xAy));
  check(VecDot(y.get(), Ax.get(), &yAx));
  check(VecNorm(x.get(), NORM_2, &norm));
  check(VecNorm(Ay.get(), NORM_2, &size));
  return std::abs(xAy - yAx) <= 1e-13 * norm * size;
}

void multiply_magnitudes(Mat A, Vec x, Vec y) {
  Mat copy;
  check(MatDuplicate(A, MAT_COPY_VALUES, &copy));
  const Handle<Mat> magnitudes(copy);
  take_magnitudes(copy);
  const auto sizes = vector_like(copy);
  check(VecCopy(x, sizes.get()));
  check(VecAbs(sizes.get()));
  check(MatMult(copy, sizes.get(), y));
}

}  // namespace gradpsi::petsc
