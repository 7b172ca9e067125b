#pragma once

#include <petscsys.h>

#include <span>
#include <utility>
#include <vector>

#include "petsc/collective.hpp"

namespace gradpsi::petsc {

/// Whether PETSc's database of options has this one, -pc_type for example.
inline bool has_option(const char* name) {
  PetscBool there;
  check(PetscOptionsHasName(nullptr, nullptr, name, &there));
  return there == PETSC_TRUE;
}

using Option = std::pair<const char*, const char*>;

/// Options that are in PETSc's database for a while, unless the user has set them.
class Defaults {
 public:
  explicit Defaults(std::span<const Option> options) {
    for (const auto& [name, value] : options) {
      if (has_option(name)) continue;
      check(PetscOptionsSetValue(nullptr, name, value));
      set_.push_back(name);
    }
  }
  Defaults(const Defaults&) = delete;
  ~Defaults() {
    for (const char* name : set_) PetscOptionsClearValue(nullptr, name);
  }

 private:
  std::vector<const char*> set_;
};

}  // namespace gradpsi::petsc
