#include "petsc/matrix.hpp"

#include <algorithm>
#include <utility>

#include "base/memory.hpp"
#include "petsc/collective.hpp"

namespace gradpsi::petsc {
namespace {

/// Compressed rows of part of the columns.
struct Block {
  std::unique_ptr<PetscInt[]> offsets, columns;
  std::unique_ptr<double[]> values;

  Block(PetscInt rows, std::size_t entries)
      : offsets(std::make_unique_for_overwrite<PetscInt[]>(rows + 1)),
        columns(std::make_unique_for_overwrite<PetscInt[]>(entries)),
        values(std::make_unique_for_overwrite<double[]>(entries)) {
    prefer_large_pages(columns.get(), sizeof(PetscInt) * entries);
    prefer_large_pages(values.get(), sizeof(double) * entries);
    offsets[0] = 0;
  }
};

/// A process's rows as PETSc holds them: columns of its own, counted from its first, and those of others.
struct Blocks {
  Block own, others;
};

std::unique_ptr<Blocks> blocks(const SparseMatrix& rows, const std::vector<PetscInt>& columns,
                               PetscInt first) {
  const auto m = static_cast<PetscInt>(rows.rows());
  const auto is_own = [&](PetscInt column) { return column >= first && column < first + m; };
  std::size_t own_count = 0;
  for (Eigen::Index e = 0; e < rows.nonZeros(); ++e)
    own_count += is_own(columns[rows.innerIndexPtr()[e]]);
  auto result =
      std::make_unique<Blocks>(Block(m, own_count), Block(m, rows.nonZeros() - own_count));
  auto& [own, others] = *result;
  PetscInt own_end = 0, others_end = 0;
  std::vector<std::pair<PetscInt, double>> sorted;
  for (PetscInt k = 0; k < m; ++k) {
    sorted.clear();
    for (SparseMatrix::InnerIterator a(rows, k); a; ++a) {
      const PetscInt column = columns[a.col()];
      if (is_own(column)) {
        own.columns[own_end] = column - first;
        own.values[own_end++] = a.value();
      } else {
        sorted.emplace_back(column, a.value());
      }
    }
    std::ranges::sort(sorted, {}, &std::pair<PetscInt, double>::first);
    for (const auto& [column, value] : sorted) {
      others.columns[others_end] = column;
      others.values[others_end++] = value;
    }
    own.offsets[k + 1] = own_end;
    others.offsets[k + 1] = others_end;
  }
  return result;
}

/// Ties the blocks' memory to the matrix that uses it.
void attach(Mat matrix, std::unique_ptr<Blocks> memory) {
  PetscContainer container;
  check(PetscContainerCreate(PETSC_COMM_SELF, &container));
  check(PetscContainerSetPointer(container, memory.release()));
  check(PetscContainerSetUserDestroy(container, [](void* blocks) -> PetscErrorCode {
    delete static_cast<Blocks*>(blocks);
    return 0;
  }));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(matrix), "gradpsi blocks",
                           reinterpret_cast<PetscObject>(container)));
  check(PetscContainerDestroy(&container));
}

}  // namespace

Handle<Mat> make_matrix(MPI_Comm comm, const SparseMatrix& rows,
                        const std::vector<PetscInt>& columns) {
  const auto m = static_cast<PetscInt>(rows.rows());
  const std::int64_t before = sum_before(comm, std::int64_t{m});
  std::unique_ptr<Blocks> memory;
  together(comm, [&] { memory = blocks(rows, columns, static_cast<PetscInt>(before)); });
  Mat matrix;
  // Nothing is copied: MatCreateMPIAIJWithArrays() would, and take ten times as long.
  check(MatCreateMPIAIJWithSplitArrays(
      comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, memory->own.offsets.get(),
      memory->own.columns.get(), memory->own.values.get(), memory->others.offsets.get(),
      memory->others.columns.get(), memory->others.values.get(), &matrix));
  Handle<Mat> result(matrix);
  attach(matrix, std::move(memory));
  return result;
}

}  // namespace gradpsi::petsc
