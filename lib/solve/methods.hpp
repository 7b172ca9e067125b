#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "solve/choice.hpp"
#include "solve/columns.hpp"

namespace gradpsi {

/// A method, prepared for a matrix.
class PreparedMethod {
 public:
  virtual ~PreparedMethod() = default;

  /// For the system's matrix as it is now; what its pattern alone decides is kept from one time to the next.
  /// @throws FactorTooLarge, Indefinite  where another method may serve; SolverError
  virtual void prepare(const LinearSystem& system, const Choice& choice) = 0;

  /// Solves for all columns in that many iterations for each; whether they are solutions.
  virtual bool solve(const LinearSystem& system, Columns& columns, int most_iterations,
                     SolveReport& result) = 0;

  virtual std::string description() const = 0;
  virtual FactorReport factor() const = 0;
};

struct MethodRow {
  Method method;
  std::string_view name;
  bool iterates;  // rather than factorises the matrix
  /// What preparing and solving cost, in iterations of conjugate gradients with the diagonal; infinite: Auto may
  /// not take it.
  double (*cost)(const Traits&);
  std::unique_ptr<PreparedMethod> (*make)();  // null for Auto itself
};

/// All methods; Auto tries the one that costs least first.
std::span<const MethodRow> methods();
const MethodRow& row_of(Method method);

}  // namespace gradpsi
