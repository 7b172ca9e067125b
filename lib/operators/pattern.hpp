#pragma once

#include <cstdint>
#include <vector>

#include "gradpsi/assemble.hpp"

namespace gradpsi {

/// The rows that are to be assembled: those asked for, or all.
struct ChosenRows {
  const std::vector<int>* chosen;  // null: all
  int count;
  int point(int k) const { return chosen ? (*chosen)[k] : k; }
};
ChosenRows chosen_rows(const AssemblyOptions& options, const Cloud& cloud);

/// Whether rows are those of a surface; points of fewer coordinates than three have none but their own.
bool on_surface(const Cloud& cloud, const AssemblyOptions& options);

/// Dimensions of the rows' systems: those of the points, or of the surface they lie on.
int row_dimension(const Cloud& cloud, const AssemblyOptions& options);

/// Refuses what an int cannot count.
void check_entries(std::int64_t entries);

/// The neighbours of the rows' points plus the diagonal, compressed; the values are left as they come.
void set_pattern(SparseMatrix& matrix, const Neighbours& near, const ChosenRows& rows, int threads);

/// Throws unless the operator's matrices have the pattern that the new values need.
void check_pattern(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                   const ChosenRows& rows, const Operator& op, const AssemblyOptions& options);

}  // namespace gradpsi
