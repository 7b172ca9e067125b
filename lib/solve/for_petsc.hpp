#pragma once

#include "solve/choice.hpp"
#include "solve/smoother.hpp"
#include "solve/twin.hpp"

// What gradpsi::petsc, a library of its own, calls of this one beside the public interface: a shared library
// shows these functions, too. The files that define them include this.
#pragma GCC visibility push(default)
namespace gradpsi {

Choice choose(const Traits& traits, Method asked, const std::vector<Refusal>& refused);
bool iterates(Method method);
int most_iterations(const Choice& choice, const SolverOptions& options);
Choice successor(const Choice& choice);
Preconditioner by_entries(const Traits& traits);

void check_rows(const SparseMatrix& A, const std::function<std::string(int)>& name);
RowTraits row_traits(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                     int threads);

Smoother smoother(const SparseMatrix& A, const std::vector<int>& diagonal, int threads);

DenseVector twin_scales(const SparseMatrix& A, const Cloud& points,
                        const std::vector<int>& diagonal, const std::vector<int>& walls,
                        int threads);
void compact_twin(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                  const VectorView& scales, int threads, SparseMatrix& twin);

}  // namespace gradpsi
#pragma GCC visibility pop
