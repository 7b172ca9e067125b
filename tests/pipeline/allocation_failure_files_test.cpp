// Memory that runs out while files are read and written.

#include <filesystem>
#include <fstream>

#include "pipeline/failing_allocations.hpp"

namespace gradpsi {
namespace {

namespace fs = std::filesystem;

class Fault20Files : public Fault20 {
 protected:
  Fault20Files() {
    std::string name = testing::TempDir() + "gradpsi-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~Fault20Files() override { fs::remove_all(folder_); }
  fs::path path(const char* name) const { return folder_ / name; }
  static std::string content(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Fails in `write`, which writes these files: each is the old one or the new one afterwards.
  void fail_writing(const std::vector<fs::path>& files, const std::function<void()>& write) {
    write();
    std::vector<std::string> whole;
    for (const fs::path& file : files) whole.push_back(content(file));
    fail_each(
        GetParam(),
        [&] {
          for (const fs::path& file : files) fs::resize_file(file, 3);
          write();
          return fs::file_size(files[0]) == whole[0].size();
        },
        [&] {
          bool all = true;
          for (std::size_t k = 0; k < files.size(); ++k)
            all &= fs::file_size(files[k]) == 3 || content(files[k]) == whole[k];
          return all && std::distance(fs::directory_iterator(folder_), {}) == std::ssize(files);
        });
  }

 private:
  fs::path folder_;
};

INSTANTIATE_TEST_SUITE_P(Failures, Fault20Files,
                         testing::Values(Failure{false, 1}, Failure{true, 1}),
                         [](const auto& the_case) {
                           return std::string(the_case.param.all ? "all_from_then_on" : "one");
                         });

TEST_P(Fault20Files, Tables) {
  Table table{{"x", "y", "T", "a name that is longer than a string's own memory"},
              Eigen::MatrixXd::Random(50, 4)};
  fail_writing({path("t.csv")}, [&] { write_csv(path("t.csv"), table); });
  fail_each(GetParam(), [&] {
    const Table read = read_csv(path("t.csv"));
    return read.names == table.names && read.values == table.values &&
           make_cloud(read).dimension() == 2;
  });
  fs::remove(path("t.csv"));
  fail_writing({path("t.vtu")}, [&] { write_vtu(path("t.vtu"), table); });
}

TEST_P(Fault20Files, Matrices) {
  const Cloud cloud = irregular_cloud(2, 6);
  const auto axes =
      assemble("gradient-direct-soc", cloud, find_neighbours(cloud, 3 * cloud.spacing())).axes;
  const std::vector<fs::path> files = {path("a_x.mtx"), path("a_y.mtx")};
  fail_writing(files, [&] { write_matrix_market(files, axes); });
  fail_each(GetParam(), [&] { return equal(read_matrix_market(files[0]), axes[0]); });
}

}  // namespace
}  // namespace gradpsi
