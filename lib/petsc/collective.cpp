#include "petsc/collective.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <stdexcept>

#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"

namespace gradpsi::petsc {
namespace {

enum class Kind { Input, Stencil, Solver, Memory, Other };

/// An error as processes tell one another.
struct Failure {
  Kind kind;
  int point, neighbours;
  double number;  // reciprocal condition, or residual
  std::string message;
};

Failure caught() {
  try {
    throw;
  } catch (const InvalidInput& error) {
    return {Kind::Input, 0, 0, 0, error.what()};
  } catch (const StencilError& error) {
    return {Kind::Stencil, error.point, error.neighbours, error.reciprocal_condition, error.what()};
  } catch (const SolverError& error) {
    return {Kind::Solver, 0, 0, error.residual, error.what()};
  } catch (const std::bad_alloc&) {
    return {Kind::Memory, 0, 0, 0, ""};
  } catch (const std::exception& error) {
    return {Kind::Other, 0, 0, 0, error.what()};
  } catch (...) {
    return {Kind::Other, 0, 0, 0, "an error without words"};
  }
}

[[noreturn]] void raise(const Failure& f) {
  switch (f.kind) {
    case Kind::Input: throw InvalidInput(f.message);
    case Kind::Stencil: throw StencilError(f.message, f.point, f.neighbours, f.number);
    case Kind::Solver: throw SolverError(f.message, f.number);
    case Kind::Memory: throw std::bad_alloc();
    case Kind::Other: break;
  }
  throw std::runtime_error(f.message);
}

void broadcast(MPI_Comm comm, int root, Failure& f) {
  std::array<int, 4> sizes = {static_cast<int>(f.kind), f.point, f.neighbours,
                              static_cast<int>(f.message.size())};
  MPI_Bcast(sizes.data(), 4, MPI_INT, root, comm);
  f.kind = static_cast<Kind>(sizes[0]);
  f.point = sizes[1];
  f.neighbours = sizes[2];
  f.message.resize(sizes[3]);
  MPI_Bcast(&f.number, 1, MPI_DOUBLE, root, comm);
  MPI_Bcast(f.message.data(), sizes[3], MPI_CHAR, root, comm);
}

/// Doubles as whole numbers in the same order.
std::uint64_t ordinal(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x + 0.0);  // -0 becomes 0
  constexpr std::uint64_t sign = std::uint64_t{1} << 63;
  return bits & sign ? ~bits : bits | sign;
}

}  // namespace

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  char* specific = nullptr;
  PetscErrorMessage(code, &text, &specific);
  if (code == PETSC_ERR_MEM) throw std::bad_alloc();
  throw std::runtime_error("PETSc: " + std::string(text ? text : "error") +
                           (specific && *specific ? ": " + std::string(specific) : ""));
}

void together(MPI_Comm comm, const std::function<void()>& work) {
  Failure failure{};
  bool failed = false;
  try {
    work();
  } catch (...) {
    failure = caught();
    failed = true;
  }
  const int all = processes(comm);
  const int first = least_of(comm, failed ? rank_of(comm) : all);
  if (first == all) return;
  const std::string own = failed ? failure.message : "";
  broadcast(comm, first, failure);
  if (anywhere(comm, !failed || own != failure.message))
    failure.message += " (on rank " + std::to_string(first) + " of " + std::to_string(all) + ")";
  raise(failure);
}

std::pair<double, double> middle_two(MPI_Comm comm, const VectorView& values) {
  const auto n = sum_of(comm, static_cast<std::int64_t>(values.size()));
  const auto at_most = [&](std::uint64_t bound) {
    std::int64_t count = 0;
    for (const double x : values) count += ordinal(x) <= bound;
    return sum_of(comm, count);
  };
  // The least number that (n + 1) / 2 values do not exceed is one of them; it is found bit by bit.
  const std::int64_t wanted = (n + 1) / 2;
  std::uint64_t below = 0;
  for (int bit = 63; bit >= 0; --bit)
    if (const std::uint64_t trial = below | std::uint64_t{1} << bit; at_most(trial - 1) < wanted)
      below = trial;
  double lower = -std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double x : values) {
    if (ordinal(x) <= below) lower = std::max(lower, x);
    if (ordinal(x) > below) upper = std::min(upper, x);
  }
  lower = largest_of(comm, lower);
  upper = least_of(comm, upper);
  return {lower, n % 2 == 1 || at_most(below) > n / 2 ? lower : upper};
}

double median(MPI_Comm comm, const VectorView& values) {
  const auto [lower, upper] = middle_two(comm, values);
  return lower == upper ? lower : (lower + upper) / 2;
}

}  // namespace gradpsi::petsc
