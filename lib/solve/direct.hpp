#pragma once

#include <memory>

#include "solve/methods.hpp"

namespace gradpsi {

// Methods that factorise the matrix, solve by the factor and refine.
std::unique_ptr<PreparedMethod> make_cholesky();
std::unique_ptr<PreparedMethod> make_lu();

}  // namespace gradpsi
