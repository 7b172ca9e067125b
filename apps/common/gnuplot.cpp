#include "common/gnuplot.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <gradpsi/io.hpp>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "common/picture.hpp"

namespace gradpsi::apps {

using std::filesystem::path;

namespace {

/// Runs gnuplot on a script in that folder; false if it failed or is not there.
bool run_gnuplot(const path& script, const path& folder) {
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder.c_str()) == 0) execlp("gnuplot", "gnuplot", script.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

/// A folder inside another one for figures that are not complete, with links to the tables of that one.
class Drafts {
 public:
  explicit Drafts(const path& results)
      : results_(results), folder_(results / ("figures.part" + std::to_string(getpid()))) {
    std::filesystem::create_directory(folder_);
    for (const auto& entry : std::filesystem::directory_iterator(results))
      if (entry.path().extension() == ".csv")
        std::filesystem::create_symlink(entry.path(), folder_ / entry.path().filename());
  }
  Drafts(const Drafts&) = delete;
  ~Drafts() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  const path& folder() const { return folder_; }
  /// Moves the figures to the results, all or none.
  void publish() const {
    std::vector<path> figures;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      if (entry.path().extension() != ".csv") figures.push_back(entry.path().filename());
    for (const path& figure : figures)
      if (!is_complete(folder_ / figure))
        throw std::runtime_error("cannot write " + (results_ / figure).string() +
                                 ": gnuplot left it incomplete (is the disk full?)");
    for (const path& figure : figures) std::filesystem::rename(folder_ / figure, results_ / figure);
  }

 private:
  path results_, folder_;
};

}  // namespace

void draw(const path& file, const std::string& script, const path& data) {
  gradpsi::write_text(file, script);
  const path here = std::filesystem::absolute(file);
  const Drafts drafts(here.parent_path());
  if (!run_gnuplot(here, drafts.folder()))
    throw std::runtime_error("gnuplot could not draw the figures (is gnuplot-nox installed?); " +
                             data.string() + " is complete, and `gnuplot " +
                             file.filename().string() + "` in that folder draws them");
  drafts.publish();
}

}  // namespace gradpsi::apps
