#include "gradpsi/cloud.hpp"

#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"

namespace gradpsi {
namespace {

/// "point 17", by its number.
std::string point(const std::vector<std::int64_t>& numbers, Eigen::Index i) {
  return "point " + std::to_string(numbers.empty() ? i : numbers[i]);
}

void check_positions(const Positions& x, const std::vector<std::int64_t>& numbers) {
  if (x.cols() < 1 || x.cols() > 3)
    throw InvalidInput("positions must have 1, 2 or 3 columns, not " + std::to_string(x.cols()));
  if (x.rows() > std::numeric_limits<int>::max() - 1)
    throw InvalidInput("at most 2^31 - 2 points, not " + std::to_string(x.rows()));
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    if (!x.row(i).allFinite())
      throw InvalidInput(point(numbers, i) + " has coordinates " + coordinates(x, i) +
                         ", which are not finite");
}

void check_volumes(const VectorView& volumes, Eigen::Index points,
                   const std::vector<std::int64_t>& numbers) {
  if (volumes.size() == 0) return;
  if (volumes.size() != points)
    throw InvalidInput("volumes has " + std::to_string(volumes.size()) + " entries for " +
                       std::to_string(points) + " points");
  for (Eigen::Index i = 0; i < points; ++i)
    if (!(volumes[i] > 0 && std::isfinite(volumes[i])))
      throw InvalidInput(point(numbers, i) + " has volume " + shortest(volumes[i]) +
                         "; volumes must be > 0 and finite");
}

void check_numbers(const std::vector<std::int64_t>& numbers, Eigen::Index points) {
  if (!numbers.empty() && std::ssize(numbers) != points)
    throw InvalidInput("there are " + std::to_string(numbers.size()) + " numbers for " +
                       std::to_string(points) + " points");
}

void check_box(const std::array<double, 3>& box, int dimension) {
  for (int a = 0; a < 3; ++a) {
    if (!(box[a] >= 0 && std::isfinite(box[a])))
      throw InvalidInput("box length " + shortest(box[a]) + " must be >= 0 and finite");
    if (a >= dimension && box[a] != 0)
      throw InvalidInput("the box has a length in direction " + std::to_string(a + 1) +
                         ", the points have " + std::to_string(dimension) + " coordinates");
  }
}

}  // namespace

Cloud::Cloud(Positions positions, CloudOptions options)
    : positions_(std::move(positions)),
      volumes_(std::move(options.volumes)),
      box_(options.box),
      numbers_(std::move(options.numbers)) {
  check_numbers(numbers_, positions_.rows());
  check_positions(positions_, numbers_);
  check_volumes(volumes_, positions_.rows(), numbers_);
  check_box(box_, dimension());
}

void Cloud::move_to(const Positions& positions) {
  if (positions.rows() != positions_.rows() || positions.cols() != positions_.cols())
    throw InvalidInput("positions is " + std::to_string(positions.rows()) + " x " +
                       std::to_string(positions.cols()) + " for " + std::to_string(size()) +
                       " points in " + std::to_string(dimension()) + " dimensions");
  check_positions(positions, numbers_);
  positions_ = positions;
}

}  // namespace gradpsi
