#include "operators/pattern.hpp"

#include <limits>
#include <string>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "schemes/recipe.hpp"
#include "schemes/targets.hpp"

namespace gradpsi {

ChosenRows chosen_rows(const AssemblyOptions& options, const Cloud& cloud) {
  if (!options.rows) return {nullptr, cloud.size()};
  return {&*options.rows, static_cast<int>(options.rows->size())};
}

bool on_surface(const Cloud& cloud, const AssemblyOptions& options) {
  return options.on_surface && cloud.dimension() == 3;
}

int row_dimension(const Cloud& cloud, const AssemblyOptions& options) {
  return on_surface(cloud, options) ? 2 : cloud.dimension();
}

void check_entries(std::int64_t entries) {
  if (entries > std::numeric_limits<int>::max())
    throw InvalidInput("the rows would have " + std::to_string(entries) +
                       " entries, more than 2^31 - 1");
}

void set_pattern(SparseMatrix& matrix, const Neighbours& near, const ChosenRows& rows,
                 int threads) {
  const int m = rows.count;
  matrix.resize(m, near.size());
  int* const outer = matrix.outerIndexPtr();
  for (int k = 0; k < m; ++k) outer[k + 1] = outer[k] + near.count(rows.point(k)) + 1;
  resize_in_large_pages(matrix, outer[m]);
  parallel_chunks(m, 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = rows.point(k);
      int* const column = matrix.innerIndexPtr() + outer[k];
      int before = 0, l = 0;
      for (const int j : near.of(i)) {
        column[l++ + (j > i)] = j;
        before += j < i;
      }
      column[before] = i;
    }
  });
}

void check_pattern(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                   const ChosenRows& rows, const Operator& op, const AssemblyOptions& options) {
  // The gradient along a surface has as many components as the points have coordinates.
  const auto axes = static_cast<std::size_t>(target(scheme.derivative).outputs(cloud.dimension()));
  if (recipe(scheme).how == How::Programme)
    throw InvalidInput("the pattern of " + name(scheme) +
                       " depends on its values: assemble it anew");
  if (recipe(scheme).how == How::Passes)
    throw InvalidInput(name(scheme) + " is made of two passes: assemble it anew");
  if (options.on_degenerate == OnDegenerate::Widen)
    throw InvalidInput("rows of a given pattern cannot be widened: assemble them anew");
  if (op.axes.size() != axes)
    throw InvalidInput(name(scheme) + " has " + std::to_string(axes) + " matrices here, not " +
                       std::to_string(op.axes.size()));
  for (const SparseMatrix& matrix : op.axes) {
    bool same = matrix.isCompressed() && matrix.rows() == rows.count &&
                matrix.cols() == cloud.size() && std::ssize(op.rows.outcome) == rows.count;
    for (int k = 0; same && k < rows.count; ++k)
      same = matrix.outerIndexPtr()[k + 1] - matrix.outerIndexPtr()[k] ==
             near.count(rows.point(k)) + 1;
    if (!same) throw InvalidInput("the operator was not assembled with these neighbours and rows");
  }
}

}  // namespace gradpsi
