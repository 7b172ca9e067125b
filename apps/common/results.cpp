#include "common/results.hpp"

#include <fstream>
#include <gradpsi/kernel.hpp>
#include <system_error>

namespace gradpsi::apps {

void create_folder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw std::system_error(failure, "cannot create the folder " + folder.string());
}

std::string dimension_suffix(int dimension, int usual) {
  return dimension == usual ? "" : "_" + std::to_string(dimension) + "d";
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
         "\n# kernel: " + std::string(kernels().front().name) + "\n";
}

}  // namespace gradpsi::apps
