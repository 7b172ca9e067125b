#pragma once

#include <string>

#include "common/diffuse_options.hpp"
#include "common/machine.hpp"

// What `diffuse` does between the points and the steps.

namespace gradpsi::apps {

/// A column of the points, all its values finite.
Eigen::VectorXd column(const Machine& machine, const std::string& name);

/// The system to be stepped: finds the neighbours, assembles the Laplacian, and the rows at walls.
Diffusion diffusion(const DiffuseOptions& options, Machine& machine, Report& report);

/// The same with the neighbours that the machine keeps from then.
Diffusion diffusion_again(const DiffuseOptions& options, Machine& machine, Report& report);

}  // namespace gradpsi::apps
