#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace gradpsi {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  int get() const { return fd_; }
  bool close();

 private:
  int fd_;
};

/// Writes beside `file` and takes its place on commit(); without it, nothing remains. Links are
/// followed. What is not a regular file, or named by a link into /dev or /proc such as /dev/stdout, is
/// written directly.
class Output {
 public:
  explicit Output(const std::filesystem::path& file);
  ~Output();
  Output(Output&& other) noexcept;

  Output& operator<<(std::string_view text);
  Output& operator<<(double x);
  Output& operator<<(int x);

  /// Everything is with the system afterwards, so that commit() can hardly fail.
  void finish();
  void commit();

 private:
  Descriptor open();
  int open_unnamed() const;
  void give_name();
  void flush();

  std::filesystem::path file_;
  std::filesystem::path temporary_;
  bool unnamed_ = false;  // the temporary file gets its name when it is complete
  Descriptor fd_;
  std::string buffer_;
};

/// Calls write(output) on a new file, which then replaces the old one.
template <class Write>
void write_file(const std::filesystem::path& file, const Write& write) {
  Output out(file);
  write(out);
  out.finish();
  out.commit();
}

/// The lines of a file, without their ends, whatever its size.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file);

  /// The next line in `line`, valid until the next call; false at the end of the file.
  bool next(std::string_view& line);

  /// Skips to the first line that begins at byte `offset` of the file or later.
  void skip_to(std::int64_t offset);
  /// Where in the file the next line begins.
  std::int64_t line_begin() const { return read_ - static_cast<std::int64_t>(end_ - begin_); }
  /// How many bytes the file has.
  std::int64_t size() const;

  /// "file:line: ", for messages about the line last returned.
  std::string place() const;

 private:
  std::size_t refill();
  std::int64_t lines_skipped() const;

  std::filesystem::path file_;
  Descriptor fd_;
  std::string buffer_;
  std::size_t begin_ = 0, end_ = 0;  // of what has been read and not returned
  bool at_end_ = false;
  std::int64_t number_ = 0;              // of the lines that were read, after those skipped
  std::int64_t skipped_ = 0, read_ = 0;  // bytes
};

}  // namespace gradpsi
