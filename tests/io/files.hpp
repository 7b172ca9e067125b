#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "clouds.hpp"

namespace gradpsi {

namespace fs = std::filesystem;

/// A folder of its own for each test.
class Files : public testing::Test {
 protected:
  Files() {
    std::string name = testing::TempDir() + "gradpsi-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~Files() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name) const { return folder_ / name; }
  fs::path file(const std::string& content) const {
    const fs::path name = path("points.csv");
    std::ofstream(name, std::ios::binary) << content;
    return name;
  }
  static std::string content(const fs::path& name) {
    std::ifstream in(name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// The error of reading a file with this content.
  std::string error(const std::string& text) const {
    return message_of<InvalidInput>([&] { read_cloud(file(text)); });
  }
  int files() const { return static_cast<int>(std::distance(fs::directory_iterator(folder_), {})); }

 private:
  fs::path folder_;
};

}  // namespace gradpsi
