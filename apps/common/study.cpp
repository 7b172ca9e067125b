#include "common/study.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <gradpsi/io.hpp>
#include <gradpsi/kernel.hpp>
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

void StudyOptions::declare(Options& options, const std::string& domain,
                           const std::string& quick_means, const std::string& threads_mean) {
  options.file("--out", out, "DIR", "Folder for the results");
  options.count("--dimension", dimension, {1, 3}, "D", "Of the " + domain);
  options.flag("--quick", quick, quick_means);
  options.count("--threads", threads, thread_limits, "N", threads_mean);
}

void create_folder(const path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw std::system_error(failure, "cannot create the folder " + folder.string());
}

std::string provenance(int threads) {
  std::string cpu = "unknown", line;
  for (std::ifstream in("/proc/cpuinfo"); std::getline(in, line);)
    if (line.starts_with("model name")) {
      cpu = line.substr(line.find(':') + 2);
      break;
    }
  return "# gradpsi: " GRADPSI_VERSION "\n# compiler: " __VERSION__ "\n# cpu: " + cpu +
         "\n# threads: " + (threads > 0 ? std::to_string(threads) : "all") +
         "\n# kernel: " + std::string(gradpsi::kernels().front().name) + "\n";
}

std::string cell(double x, const char* format) {
  if (!std::isfinite(x)) return {};
  std::array<char, 40> digits;
  std::snprintf(digits.data(), digits.size(), format, x);
  return digits.data();
}

std::string padded(const std::string& text, int width) {
  return std::string(std::max<int>(0, width - static_cast<int>(text.size())), ' ') + text;
}

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
