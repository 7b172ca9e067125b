#pragma once

#include <vector>

#include "gradpsi/assemble.hpp"
#include "operators/batch/batch.hpp"
#include "operators/pattern.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {

/// An operator to be computed, together with others on one pattern.
struct Request {
  Operator* op;
  std::vector<Equations> steps;  // to try for each row, best first
};

/// The systems that the vector code is to solve for the requests, and which request is answered by which.
struct Plan {
  std::vector<BatchSystem> systems;
  std::vector<int> of_request;  // -1: none, row by row
};
Plan plan(const std::vector<Request>& requests, int dimension);

}  // namespace gradpsi
