#include "mpi/outputs.hpp"

#include <algorithm>
#include <utility>

#include "common/outputs.hpp"
#include "common/picture.hpp"

namespace gradpsi::apps {

using petsc::together;
using std::filesystem::path;

void write_csv_together(const path& file, const Table& part) {
  constexpr Eigen::Index rows_at_once = 1 << 16;
  const int columns = static_cast<int>(part.values.cols());
  Eigen::Index done = 0;
  const auto next_part = [&](Table& table) {
    const Eigen::Index rows = std::min(rows_at_once, part.values.rows() - done);
    table = {part.names, part.values.middleRows(done, rows)};
    done += rows;
    return rows > 0;
  };
  constexpr int tag = 0;
  if (rank() > 0) {
    Table piece;
    for (bool more = true; more;) {
      more = next_part(piece);
      MPI_Send(piece.values.data(), static_cast<int>(piece.values.size()), MPI_DOUBLE, 0, tag,
               comm());
    }
    return;
  }
  int from = 0;
  bool named = false;
  gradpsi::write_csv(file, [&](Table& table) {
    if (from == 0) {
      // Without rows, too, the first piece gives the names.
      if (next_part(table) || !std::exchange(named, true)) {
        named = true;
        return true;
      }
      ++from;
    }
    for (; from < processes(); ++from) {
      MPI_Status status;
      MPI_Probe(from, tag, comm(), &status);
      int count;
      MPI_Get_count(&status, MPI_DOUBLE, &count);
      table = {part.names, Eigen::MatrixXd(count / columns, columns)};
      MPI_Recv(table.values.data(), count, MPI_DOUBLE, from, tag, comm(), MPI_STATUS_IGNORE);
      if (count > 0) return true;
    }
    return false;
  });
}

namespace {

/// OUT_rank0.vtu and so on.
std::vector<path> pieces_of(const path& file) {
  std::vector<path> pieces;
  for (int r = 0; r < processes(); ++r)
    pieces.push_back(
        path(file).replace_filename(file.stem().string() + "_rank" + std::to_string(r) + ".vtu"));
  return pieces;
}

}  // namespace

std::vector<path> parts_of(const path& file) {
  std::vector<path> parts;
  if (file.extension() == ".pvtu") parts = pieces_of(file);
  parts.push_back(file);
  return parts;
}

void write_pieces(const OperatorOptions& options, const path& file, const Table& part) {
  const std::vector<path> pieces = pieces_of(file);
  together(comm(), [&] {
    check_outputs(options, {file, pieces[rank()]});
    write_vtu(pieces[rank()], part);
  });
  together(comm(), [&] {
    if (rank() == 0) write_pvtu(file, part.names, pieces);
  });
}

bool draw_together(const path& picture, const Given& given, const Table& part,
                   const std::string& name, const std::string& title) {
  constexpr std::int64_t most = 200'000;
  const int dimension = given.partition->cloud().dimension();
  const std::int64_t every = (given.all + most - 1) / most;
  std::vector<Eigen::VectorXd> columns;
  for (int a = 0; a < dimension; ++a) columns.push_back(part.column(std::string(1, "xyz"[a])));
  columns.push_back(part.column(name));
  std::vector<double> here;
  for (Eigen::Index k = 0; k < part.values.rows(); ++k)
    if ((given.first + k) % every == 0)
      for (const Eigen::VectorXd& column : columns) here.push_back(column[k]);
  const std::vector<double> all = gathered(here);
  if (rank() > 0) return false;
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
      values(all.data(), std::ssize(all) / (dimension + 1), dimension + 1);
  return draw_field(picture, values.leftCols(dimension), values.col(dimension), name, title);
}

}  // namespace gradpsi::apps
