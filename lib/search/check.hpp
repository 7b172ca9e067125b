#pragma once

#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// Throws InvalidInput unless `near` can be the neighbours of `cloud`'s points, which have not moved further
/// than its skin allows.
void check_match(const Cloud& cloud, const Neighbours& near, int threads);

}  // namespace gradpsi
