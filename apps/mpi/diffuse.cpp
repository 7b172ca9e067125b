// gradpsi-mpi diffuse: what gradpsi diffuse does, by several processes.

#include <sys/resource.h>

#include <algorithm>
#include <gradpsi/petsc.hpp>
#include <iostream>
#include <limits>
#include <memory>
#include <numeric>

#include "../../lib/base/stopwatch.hpp"
#include "../../lib/petsc/collective.hpp"
#include "commands/diffuse_options.hpp"
#include "common/picture.hpp"
#include "mpi/commands.hpp"

namespace gradpsi::apps {

namespace {

namespace petsc = gradpsi::petsc;
using gradpsi::Stopwatch;
using petsc::together;
using std::filesystem::path;

MPI_Comm comm() { return PETSC_COMM_WORLD; }
int rank() { return petsc::rank_of(comm()); }
bool is_first() { return rank() == 0; }

/// This process's share of the file's points.
struct Given {
  gradpsi::Table table;
  std::int64_t first = 0, all = 0;  // number of its first point, and of points in the file

  void count() {
    const std::int64_t rows = table.values.rows();
    first = petsc::sum_before(comm(), rows);
    all = petsc::sum_of(comm(), rows);
  }
  gradpsi::Cloud cloud(const OperatorOptions& options) const {
    gradpsi::CloudOptions of_cloud = cloud_options(options, table);
    of_cloud.numbers.resize(table.values.rows());
    std::iota(of_cloud.numbers.begin(), of_cloud.numbers.end(), first);
    return make_cloud(table, std::move(of_cloud));
  }
};

petsc::Partition partition_of(const Given& given, const OperatorOptions& options) {
  gradpsi::Cloud cloud(gradpsi::Positions(0, 1));
  together(comm(), [&] { cloud = given.cloud(options); });
  return petsc::Partition(comm(), cloud);
}

/// Leaves only the first of each group of coincident points.
void drop_duplicates(Given& given, const petsc::Partition& partition) {
  Eigen::VectorXd dropped = Eigen::VectorXd::Zero(partition.cloud().size());
  for (const int k : petsc::coincident_points(partition)) dropped[k] = 1;
  const Eigen::VectorXd of_given = partition.to_givers(dropped);
  std::vector<int> kept;
  for (int k = 0; k < of_given.size(); ++k)
    if (of_given[k] == 0) kept.push_back(k);
  given.table = given.table.select(kept);
  given.count();
}

/// Texts of all processes, by rank, in the first one.
std::vector<std::string> texts(const std::string& here) {
  const int size = static_cast<int>(here.size()), all = petsc::processes(comm());
  const std::vector<int> sizes = petsc::gathered(comm(), size);
  std::vector<int> offsets(all);
  std::exclusive_scan(sizes.begin(), sizes.end(), offsets.begin(), 0);
  std::string joined(is_first() ? offsets.back() + sizes.back() : 0, '\0');
  MPI_Gatherv(here.data(), size, MPI_CHAR, joined.data(), sizes.data(), offsets.data(), MPI_CHAR, 0,
              comm());
  std::vector<std::string> result;
  for (int r = 0; r < all && is_first(); ++r) result.push_back(joined.substr(offsets[r], sizes[r]));
  return result;
}

/// Prints the warnings of the first process that has any; they are of its own points.
void warn(const petsc::Subdomain& mine, const gradpsi::Neighbours& near, int threads,
          nlohmann::ordered_json& report) {
  auto list = nlohmann::ordered_json::array();
  together(comm(), [&] {
    for (const std::string& warning : gradpsi::warnings(mine.cloud(), near, threads))
      list.push_back(warning);
  });
  for (const std::string& text : texts(list.dump())) {
    const auto warnings = nlohmann::ordered_json::parse(text);
    if (warnings.empty() || report.contains("warnings")) continue;
    for (const std::string warning : warnings) std::cerr << "warning: " << warning << '\n';
    report["warnings"] = warnings;
  }
}

nlohmann::ordered_json neighbour_counts(const petsc::Subdomain& mine,
                                        const gradpsi::Neighbours& near) {
  Eigen::VectorXd counts(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < counts.size(); ++k) counts[k] = near.count(mine.own()[k]);
  if (mine.partition().size() == 0) return {{"min", 0}, {"median", 0}, {"max", 0}};
  const bool none = counts.size() == 0;
  const double least =
      petsc::least_of(comm(), none ? std::numeric_limits<double>::max() : counts.minCoeff());
  const double most = petsc::largest_of(comm(), none ? 0 : counts.maxCoeff());
  const double median = petsc::median(comm(), counts);
  nlohmann::ordered_json middle = median;
  if (median == std::floor(median)) middle = static_cast<int>(median);
  return {{"min", static_cast<int>(least)}, {"median", middle}, {"max", static_cast<int>(most)}};
}

/// The degenerate rows of all processes, by number; of very many only some are listed.
nlohmann::ordered_json all_degenerate_rows(const gradpsi::Operator& op,
                                           const gradpsi::Cloud& cloud) {
  constexpr std::size_t most = 1'000'000;
  nlohmann::ordered_json result = degenerate_rows(op, cloud);
  for (const char* outcome : {"lowered", "widened", "zero"})
    result[outcome] = petsc::sum_of(comm(), result[outcome].get<std::int64_t>());
  auto& own = result["rows"];
  if (const std::size_t share = most / petsc::processes(comm()); own.size() > share)
    own.erase(own.begin() + static_cast<std::ptrdiff_t>(share), own.end());
  std::vector<nlohmann::ordered_json> rows;
  for (const std::string& text : texts(own.dump())) {
    const auto part = nlohmann::ordered_json::parse(text);
    rows.insert(rows.end(), part.begin(), part.end());
  }
  std::ranges::sort(rows, {},
                    [](const auto& row) { return row["point"].template get<std::int64_t>(); });
  result["rows"] = rows;
  return result;
}

/// Of all processes, with the number of its point.
WorstRow worst_condition(const gradpsi::Operator& op, const petsc::Subdomain& mine) {
  constexpr auto none = std::numeric_limits<std::int64_t>::max();
  double least = std::numeric_limits<double>::infinity();
  std::int64_t point = none;
  if (Eigen::Index row; op.rows.reciprocal_condition.size() > 0) {
    least = op.rows.reciprocal_condition.minCoeff(&row);
    point = mine.cloud().number(mine.own()[row]);
  }
  const double least_of_all = petsc::least_of(comm(), least);
  point = petsc::least_of(comm(), least == least_of_all ? point : none);
  if (point == none) return std::nullopt;
  return std::pair(least_of_all, point);
}

/// Each process's own points, the operator on them, and what is said of it; as Problem is for one process.
class MpiProblem {
 public:
  explicit MpiProblem(const DiffuseOptions& options) : options_(options) {
    Stopwatch watch;
    together(comm(), [&] {
      given_.table = gradpsi::read_csv(options.points, rank(), petsc::processes(comm()));
    });
    given_.count();
    const std::int64_t read = given_.all;
    partition_.emplace(partition_of(given_, options));
    if (options.duplicates == "drop") {
      drop_duplicates(given_, *partition_);
      partition_.emplace(partition_of(given_, options));
    }
    own_ = {given_.table.names, partition_->to_owners(given_.table.values)};
    report = first_report(options, given_.all, read - given_.all, watch.lap());
    report["processes"] = petsc::processes(comm());
  }

  const petsc::Partition& partition() const { return *partition_; }

  /// An own point's column, all finite.
  Eigen::VectorXd column(const std::string& name) const {
    Eigen::VectorXd result;
    together(comm(), [&] { result = finite_column(own_, partition_->cloud(), name); });
    return result;
  }

  petsc::ImplicitDiffusion diffusion() {
    gradpsi::BoundaryConditions conditions;
    together(comm(), [&] { conditions = boundary(options_, own_, partition_->cloud()); });
    find_neighbours();
    for (auto* points : {&conditions.fixed.points, &conditions.walls.points})
      for (int& point : *points) point = mine_->own()[point];
    // Rows that conditions take the place of need not be there.
    std::vector<int> unused = conditions.fixed.points;
    unused.insert(unused.end(), conditions.walls.points.begin(), conditions.walls.points.end());
    gradpsi::Operator op = assemble(unused);
    add_gradient(conditions.walls);
    if (!options_.conductivity.empty())
      op = petsc::with_conductivity(std::move(op), *mine_, column(options_.conductivity),
                                    mean(options_));
    gradpsi::DiffusionOptions diffusion;
    together(comm(), [&] { diffusion = equation(options_, own_, partition_->cloud()); });
    near_ = {};
    return {*mine_, std::move(op), conditions, diffusion};
  }

  /// The points that this process read, with the field of own points.
  gradpsi::Table given_with(const Eigen::VectorXd& u) {
    given_.table.set(options_.field, partition_->to_givers(u));
    return given_.table;
  }
  std::int64_t first_given() const { return given_.first; }

  bool has_support_column() const { return own_.has("support"); }

  nlohmann::ordered_json report;  ///< what --report writes
  WorstRow worst;

 private:
  void find_neighbours() {
    Stopwatch watch;
    const bool empty = partition_->size() == 0;
    const Eigen::VectorXd h = supports(
        options_, own_, [&] { return empty ? 1 : petsc::spacing(*partition_, options_.threads); });
    const bool widens =
        assembly_options(options_, own_).on_degenerate == gradpsi::OnDegenerate::Widen;
    // What is no support is refused by find_neighbours(), which names the point.
    Eigen::VectorXd reach =
        h.unaryExpr([&](double x) { return x > 0 ? (widens ? gradpsi::widest : 1) * x : 0; });
    for (const double length : options_.periodic)
      if (length > 0) reach = reach.cwiseMin(length / 2).cwiseMax(h);
    mine_.emplace(*partition_, reach);
    near_ = petsc::find_neighbours(*mine_, h, options_.threads);
    warn(*mine_, near_, options_.threads, report);
    report["seconds"]["search"] = watch.lap();
  }

  gradpsi::Operator assemble(const std::vector<int>& unused) {
    Stopwatch watch;
    const gradpsi::AssemblyOptions assembly = assembly_options(options_, own_);
    const auto rows_of = [&](const gradpsi::Scheme& scheme, const gradpsi::AssemblyOptions& rows) {
      return petsc::assemble(scheme, *mine_, near_, rows);
    };
    const bool some_unused = petsc::anywhere(comm(), !unused.empty());
    gradpsi::Operator op;
    try {
      op = some_unused ? assembled(options_, assembly, unused, mine_->cloud().size(), rows_of)
                       : rows_of(options_.scheme, assembly);
    } catch (const gradpsi::StencilError& error) {
      throw std::runtime_error(advice(error, report));
    }
    report["seconds"]["weights"] = watch.lap();
    report["entries"] = petsc::sum_of(comm(), std::int64_t{op.matrix().nonZeros()});
    report["neighbours"] = neighbour_counts(*mine_, near_);
    const std::int64_t degenerate = petsc::sum_of(comm(), std::int64_t{op.rows.degenerate()});
    report["degenerate_rows"] = degenerate;
    if (degenerate > 0) report["degenerate"] = all_degenerate_rows(op, mine_->cloud());
    worst = worst_condition(op, *mine_);
    return op;
  }

  /// n . grad u = flux: the gradients at the walls' points.
  void add_gradient(gradpsi::WallConditions& walls) {
    const std::int64_t count =
        petsc::sum_of(comm(), static_cast<std::int64_t>(walls.points.size()));
    if (count == 0) return;
    gradpsi::AssemblyOptions assembly = assembly_options(options_, own_);
    assembly.rows = walls.points;
    gradpsi::Operator gradient;
    try {
      gradient = petsc::assemble(options_.gradient, *mine_, near_, assembly);
    } catch (const gradpsi::StencilError& error) {
      throw std::runtime_error(gradient_advice(error));
    }
    const std::int64_t degenerate = petsc::sum_of(comm(), std::int64_t{gradient.rows.degenerate()});
    if (degenerate > 0) {
      if (is_first()) std::cout << gradient_note(options_, degenerate, count);
      auto& all = report["degenerate_rows"];
      all = all.get<std::int64_t>() + degenerate;
    }
    walls.gradient = std::move(gradient.axes);
  }

  const DiffuseOptions& options_;
  Given given_;
  std::optional<petsc::Partition> partition_;
  gradpsi::Table own_;
  std::optional<petsc::Subdomain> mine_;
  gradpsi::Neighbours near_;
};

/// One file with the rows of all processes, by rank, written by the first.
void write_csv_together(const path& file, const gradpsi::Table& part) {
  constexpr Eigen::Index rows_at_once = 1 << 16;
  const int columns = static_cast<int>(part.values.cols());
  Eigen::Index done = 0;
  const auto next_part = [&](gradpsi::Table& table) {
    const Eigen::Index rows = std::min(rows_at_once, part.values.rows() - done);
    table = {part.names, part.values.middleRows(done, rows)};
    done += rows;
    return rows > 0;
  };
  constexpr int tag = 0;
  if (!is_first()) {
    gradpsi::Table piece;
    for (bool more = true; more;) {
      more = next_part(piece);
      MPI_Send(piece.values.data(), static_cast<int>(piece.values.size()), MPI_DOUBLE, 0, tag,
               comm());
    }
    return;
  }
  int from = 0;
  bool named = false;
  gradpsi::write_csv(file, [&](gradpsi::Table& table) {
    if (from == 0) {
      // Without rows, too, the first piece gives the names.
      if (next_part(table) || !std::exchange(named, true)) {
        named = true;
        return true;
      }
      ++from;
    }
    for (; from < petsc::processes(comm()); ++from) {
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

path with_ending(path file, const std::string& ending) {
  return file.replace_filename(file.stem().string() + ending);
}

/// OUT_rank0.vtu and so on.
std::vector<path> pieces_of(const path& file) {
  std::vector<path> pieces;
  for (int r = 0; r < petsc::processes(comm()); ++r)
    pieces.push_back(with_ending(file, "_rank" + std::to_string(r) + ".vtu"));
  return pieces;
}

/// A .pvtu and a piece beside it for each process.
void write_pieces(const OperatorOptions& options, const path& file, const gradpsi::Table& part) {
  const std::vector<path> pieces = pieces_of(file);
  together(comm(), [&] {
    check_outputs(options, {file, pieces[rank()]});
    write_vtu(pieces[rank()], part);
  });
  together(comm(), [&] {
    if (is_first()) gradpsi::write_pvtu(file, part.names, pieces);
  });
}

/// Numbered .pvtu files, and the .pvd that lists them with their times.
class Series {
 public:
  explicit Series(const DiffuseOptions& options) : options_(options) {}

  void write(const gradpsi::Table& part, int step) {
    const path file = options_.numbered(step, ".pvtu"), list = options_.beside(".pvd");
    write_pieces(options_, file, part);
    written_.emplace_back(step * *options_.time_step, file);
    together(comm(), [&] {
      check_outputs(options_, {list});
      if (is_first()) gradpsi::write_pvd(list, written_);
    });
  }

 private:
  const DiffuseOptions& options_;
  std::vector<std::pair<double, path>> written_;
};

/// The picture, from some of all processes' points.
bool draw(const path& file, const DiffuseOptions& options, const MpiProblem& problem,
          const gradpsi::Table& part) {
  constexpr std::int64_t most = 200'000;
  const int dimension = problem.partition().cloud().dimension();
  const std::int64_t every = (problem.partition().size() + most - 1) / most;
  std::vector<double> here;
  const Eigen::VectorXd u = part.column(options.field);
  std::vector<Eigen::VectorXd> x;
  for (int a = 0; a < dimension; ++a) x.push_back(part.column(std::string(1, "xyz"[a])));
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    if ((problem.first_given() + k) % every != 0) continue;
    for (int a = 0; a < dimension; ++a) here.push_back(x[a][k]);
    here.push_back(u[k]);
  }
  const int size = static_cast<int>(here.size());
  const std::vector<int> sizes = petsc::gathered(comm(), size);
  std::vector<int> offsets(sizes.size());
  std::exclusive_scan(sizes.begin(), sizes.end(), offsets.begin(), 0);
  gradpsi::Positions all((offsets.back() + sizes.back()) / (dimension + 1), dimension + 1);
  MPI_Gatherv(here.data(), size, MPI_DOUBLE, all.data(), sizes.data(), offsets.data(), MPI_DOUBLE,
              0, comm());
  return is_first() && draw_field(file, all.leftCols(dimension), all.col(dimension), options.field,
                                  options.title());
}

Range range_of_all(const Eigen::VectorXd& u) {
  if (petsc::sum_of(comm(), std::int64_t{u.size()}) == 0) return {0, 0};
  const double most = std::numeric_limits<double>::max();
  return {petsc::least_of(comm(), u.size() > 0 ? u.minCoeff() : most),
          petsc::largest_of(comm(), u.size() > 0 ? u.maxCoeff() : -most)};
}

void write_report(const OperatorOptions& options, nlohmann::ordered_json& report) {
  for (auto& seconds : report["seconds"])
    seconds = petsc::largest_of(comm(), seconds.get<double>());
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  report["peak_bytes"] = petsc::largest_of(comm(), std::int64_t{usage.ru_maxrss} * 1024);
  together(comm(), [&] {
    if (is_first() && !options.report.empty())
      gradpsi::write_text(options.report, report.dump(2) + "\n");
  });
}

void run(const DiffuseOptions& options) {
  options.check();
  const bool csv = options.output.extension() == ".csv";
  const path picture = options.beside(".png"),
             output = csv ? options.output : options.beside(".pvtu");
  std::vector<path> files = csv ? std::vector<path>() : pieces_of(output);
  files.insert(files.end(), {output, picture});
  check_outputs(options, files);
  MpiProblem problem(options);
  Eigen::VectorXd u = problem.column(options.field);
  const Range before = range_of_all(u);
  petsc::ImplicitDiffusion heat = problem.diffusion();

  Series series(options);
  const auto keep = [&](int step) {
    if (options.keeps(step)) series.write(problem.given_with(u), step);
  };
  keep(0);
  const Stepper stepper{.step = [&](Eigen::VectorXd& field) { return heat.step(field); },
                        .largest = [](double x) { return petsc::largest_of(comm(), x); },
                        .shows_progress = is_first()};
  const auto steps = solve(options, stepper, u, keep);

  Stopwatch watch;
  const gradpsi::Table part = problem.given_with(u);
  csv ? write_csv_together(output, part) : write_pieces(options, output, part);
  auto& report = problem.report;
  report["seconds"]["write"] = watch.lap();
  report["solver"] = json(heat.solver());
  report["steps"] = steps;
  write_report(options, report);
  const bool drawn = draw(picture, options, problem, part);
  const Range after = range_of_all(u);
  if (is_first() &&
      print_summary(options, report, problem.worst, problem.has_support_column(), {output}))
    print_solution(options, heat.solver(), steps, before, after, picture, drawn);
}

}  // namespace

std::function<void()> declare_mpi_diffuse(Options& options) {
  auto wanted = std::make_shared<DiffuseOptions>();
  wanted->declare_diffusion(
      options,
      "OUT.csv: the input's columns, the field as it is at last. OUT.vtu: the same as OUT.pvtu\n"
      "and a piece a process, OUT_rank0.vtu, .. And a picture of it, OUT.png",
      "mpirun -n 2 gradpsi-mpi");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
