#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <gradpsi/gradpsi.hpp>
#include <string>
#include <vector>

namespace gradpsi::apps {

// The parts of the stability study that look at single cases closely. Each writes a CSV file into the
// folder and returns what a person should read of it.

/// A field with its Laplacian (n values each) and bounds of its partial derivatives of order 0, 1, ...
struct Field {
  Eigen::VectorXd u, laplacian;
  Eigen::MatrixXd bounds;  ///< as error_bound() takes them
};

/// cos(2 pi x) cos(2 pi y) cos(2 pi z), periodic in the unit box; bounds up to order `most`.
Field periodic_field(const gradpsi::Positions& x, int most);

/// Points of a lattice that are not in its outermost layer, ascending.
std::vector<int> inner_points(int dimension, int points_per_side);

/// failure.csv: the second-order Laplacians of the tables where they break, and least squares with the
/// same weights; errors, condition numbers, amplification, error bounds.
std::string failing_cases(const std::filesystem::path& folder, bool quick);

/// orders.csv: laplacian-ls-P on ever finer jittered squares.
std::string orders_of_least_squares(const std::filesystem::path& folder, bool quick);

/// floor.csv: a second derivative in 1D at ever smaller spacing, its moments in units of h and not.
std::string cancellation_floor(const std::filesystem::path& folder);

/// spectra.csv, rk4_region.csv and history.csv: eigenvalues of a scheme that grows and of one that does not, on the same
/// points; the largest value of a field that each diffuses, with explicit and with implicit steps.
std::string growth_and_cure(const std::filesystem::path& folder);

}  // namespace gradpsi::apps
