#pragma once

#include <string>

#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"

namespace gradpsi {

/// Throws InvalidInput unless `near` can be the neighbours of `cloud`'s points.
inline void check_match(const Cloud& cloud, const Neighbours& near) {
  if (near.size() != cloud.size())
    throw InvalidInput("the neighbours are of " + std::to_string(near.size()) +
                       " points, the cloud has " + std::to_string(cloud.size()));
  if (near.supports.size() != 1 && near.supports.size() != near.size())
    throw InvalidInput("the neighbours have " + std::to_string(near.supports.size()) +
                       " supports for " + std::to_string(near.size()) + " points");
}

}  // namespace gradpsi
