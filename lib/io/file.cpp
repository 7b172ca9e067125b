#include "io/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>

#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

constexpr std::size_t block = 1 << 20;  // bytes written at once; also the longest line accepted
constexpr std::size_t read_block = 1 << 16;  // small files should cost little

[[noreturn]] void throw_system(const std::string& what, const path& file) {
  throw std::system_error(errno, std::generic_category(), what + " " + file.string());
}

bool is_of_the_system(const path& file) {
  return file.string().starts_with("/dev/") || file.string().starts_with("/proc/");
}

path target_of(path file) {
  std::error_code ignored;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(file, ignored); ++links) {
    if (is_of_the_system(file)) break;
    file = file.parent_path() / std::filesystem::read_symlink(file);
  }
  return file;
}

path temporary_name(const path& file) {
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  const bool regular = std::filesystem::is_regular_file(status) && !is_of_the_system(file);
  if (std::filesystem::exists(status) && !regular) return {};
  path name = file;
  name += ".part" + std::to_string(::getpid());
  return name;
}

template <class Number>
std::string_view digits_of(Number x, char (&digits)[32]) {
  return {digits, std::to_chars(digits, digits + sizeof digits, x).ptr};
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

bool Descriptor::close() { return ::close(std::exchange(fd_, -1)) == 0; }

Output::Output(const path& file)
    : file_(target_of(file)), temporary_(temporary_name(file_)), fd_(open()) {}

Output::~Output() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Output::Output(Output&& other) noexcept
    : file_(std::move(other.file_)),
      temporary_(std::exchange(other.temporary_, {})),
      unnamed_(other.unnamed_),
      fd_(std::move(other.fd_)),
      buffer_(std::move(other.buffer_)) {}

Output& Output::operator<<(std::string_view text) {
  if (buffer_.size() + text.size() > block) flush();
  buffer_ += text;
  return *this;
}

Output& Output::operator<<(double x) {
  char digits[32];
  return *this << digits_of(x, digits);
}

Output& Output::operator<<(int x) {
  char digits[32];
  return *this << digits_of(x, digits);
}

void Output::finish() {
  flush();
  if (unnamed_) give_name();
  if (!fd_.close()) throw_system("cannot write", file_);
}

void Output::commit() {
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) throw_system("cannot write", file_);
  temporary_.clear();
}

Descriptor Output::open() {
  const path& name = temporary_.empty() ? file_ : temporary_;
  int fd = temporary_.empty() ? -1 : open_unnamed();
  unnamed_ = fd >= 0;
  if (fd < 0) fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) throw_system("cannot write", file_);
  struct stat old;  // whose permissions the new file keeps
  if (!temporary_.empty() && ::stat(file_.c_str(), &old) == 0) ::fchmod(fd, old.st_mode & 07777);
  return Descriptor(fd);
}

/// A file that has no name yet, of which nothing remains whatever ends the program; -1 where there is
/// no such thing.
int Output::open_unnamed() const {
#if defined(O_TMPFILE)
  const path folder = file_.has_parent_path() ? file_.parent_path() : ".";
  if (::access("/proc/self/fd", X_OK) == 0)
    return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
  return -1;
}

void Output::give_name() {
  const std::string nameless = "/proc/self/fd/" + std::to_string(fd_.get());
  ::unlink(temporary_.c_str());  // of a program that was killed, if it had the same number
  if (::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) != 0)
    throw_system("cannot write", file_);
}

void Output::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const auto written = ::write(fd_.get(), rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_system("cannot write", file_);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
}

Lines::Lines(const path& file) : file_(file), fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (fd_.get() < 0) throw_system("cannot read", file_);
  buffer_.resize(read_block);
}

bool Lines::next(std::string_view& line) {
  std::size_t searched = begin_;
  for (;;) {
    const auto* newline =
        static_cast<const char*>(std::memchr(buffer_.data() + searched, '\n', end_ - searched));
    if (newline || (at_end_ && begin_ < end_)) {
      const std::size_t stop = newline ? newline - buffer_.data() : end_;
      line = std::string_view(buffer_).substr(begin_, stop - begin_);
      begin_ = std::min(stop + 1, end_);
      ++number_;
      if (line.ends_with('\r')) line.remove_suffix(1);
      return true;
    }
    if (at_end_) return false;
    searched = refill();
  }
}

void Lines::skip_to(std::int64_t offset) {
  if (offset <= line_begin()) return;
  if (::lseek(fd_.get(), offset - 1, SEEK_SET) < 0) throw_system("cannot read", file_);
  skipped_ = read_ = offset - 1;
  begin_ = end_ = 0;
  at_end_ = false;
  number_ = 0;
  std::string_view rest_of_a_line;
  next(rest_of_a_line);
}

std::int64_t Lines::size() const {
  struct stat status;
  if (::fstat(fd_.get(), &status) != 0) throw_system("cannot read", file_);
  if (!S_ISREG(status.st_mode)) errno = ESPIPE, throw_system("cannot read a part of", file_);
  return status.st_size;
}

std::string Lines::place() const {
  return file_.string() + ":" + std::to_string(lines_skipped() + number_) + ": ";
}

/// Moves the unfinished line to the front and reads on; returns where the new bytes begin.
std::size_t Lines::refill() {
  std::copy(buffer_.begin() + begin_, buffer_.begin() + end_, buffer_.begin());
  end_ -= std::exchange(begin_, 0);
  if (end_ == block)
    throw InvalidInput(file_.string() + ":" + std::to_string(lines_skipped() + number_ + 1) +
                       ": the line is longer than " + std::to_string(block) + " bytes");
  if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  ssize_t got;
  do got = ::read(fd_.get(), buffer_.data() + end_, buffer_.size() - end_);
  while (got < 0 && errno == EINTR);
  if (got < 0) throw_system("cannot read", file_);
  at_end_ = got == 0;
  end_ += static_cast<std::size_t>(got);
  read_ += got;
  return end_ - static_cast<std::size_t>(got);
}

/// Counted when there is something to say about a line.
std::int64_t Lines::lines_skipped() const {
  if (skipped_ == 0) return 0;
  Lines before(file_);
  std::string_view line;
  std::int64_t count = 0;
  while (before.line_begin() < skipped_ && before.next(line)) ++count;
  return count - (before.line_begin() > skipped_);
}

void write_text(const path& file, std::string_view text) {
  write_file(file, [&](Output& out) { out << text; });
}

}  // namespace gradpsi
