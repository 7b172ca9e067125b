#pragma once

#include <string>
#include <vector>

#include "common/diffuse_options.hpp"
#include "common/machine.hpp"

// What `diffuse` does between the points and the steps.

namespace gradpsi::apps {

/// A column of the points, all its values finite.
Eigen::VectorXd column(const Machine& machine, const std::string& name);

/// Fixed points, and those with a normal that are not fixed, by their places in the table; gradients are still
/// empty.
BoundaryConditions conditions_of(const ConditionOptions& options, const Machine& machine);

/// The Laplacian, once neighbours are known. Rows that conditions take the place of may be degenerate, even
/// where that is an error.
/// @param stable  whether rows that are chosen to a tolerance are to let no solution grow
Operator laplacian(const ConditionOptions& options, Machine& machine,
                   const BoundaryConditions& conditions, bool stable, Report& report);

/// Reports the operator with the rows that know the slope at walls. What walls it cannot take up remain in
/// `conditions`, with a gradient; all of them if the options say so.
/// @return  what the flux adds to lap u
Eigen::VectorXd set_walls(const ConditionOptions& options, Machine& machine,
                          BoundaryConditions& conditions, Operator& laplacian, Report& report,
                          std::vector<std::string>& remarks);

/// The system to be stepped: finds the neighbours, assembles the Laplacian, and the rows at walls.
Diffusion diffusion(const DiffuseOptions& options, Machine& machine, Report& report);

/// The same with the neighbours that the machine keeps from then.
Diffusion diffusion_again(const DiffuseOptions& options, Machine& machine, Report& report);

}  // namespace gradpsi::apps
