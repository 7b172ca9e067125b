#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "gradpsi/petsc_partition.hpp"

namespace gradpsi::petsc {

struct Release {
  void operator()(PC object) const { PCDestroy(&object); }
  void operator()(IS object) const { ISDestroy(&object); }
};
template <class Object>
using Owned = std::unique_ptr<std::remove_pointer_t<Object>, Release>;

/// gradpsi::WallCorrection for rows that are spread over processes.
class WallCorrection {
 public:
  /// @param walls  among this process's rows
  WallCorrection(MPI_Comm comm, Mat A, const std::vector<int>& walls);

  /// Whether it has an effect: the rows are not singular.
  explicit operator bool() const { return ksp_ != nullptr; }

  /// Makes z meet the boundary conditions, given the residuals r.
  void correct(Vec r, Vec z) const;

 private:
  Handle<Mat> rows_, among_;
  Handle<Vec> residual_, correction_;
  Handle<PetscSF> scatter_;
  Handle<KSP> ksp_;  // none if the rows are singular
};

}  // namespace gradpsi::petsc
