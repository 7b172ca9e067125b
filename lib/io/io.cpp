#include "gradpsi/io.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <system_error>
#include <utility>

#include "base/text.hpp"
#include "gradpsi/error.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

constexpr std::size_t block = 1 << 20;  // bytes written at once; also the longest line accepted
constexpr std::size_t read_block = 1 << 16;  // small files should cost little

[[noreturn]] void throw_system(const std::string& what, const path& file) {
  throw std::system_error(errno, std::generic_category(), what + " " + file.string());
}

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  int get() const { return fd_; }
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

/// Writes beside `file` and takes its place on commit(); without it, nothing remains. Links are
/// followed. What is not a regular file, or named by a link into /dev or /proc such as /dev/stdout, is
/// written directly.
class Output {
 public:
  explicit Output(const path& file)
      : file_(target(file)), temporary_(temporary(file_)), fd_(open()) {}
  ~Output() {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }
  Output(Output&& other) noexcept
      : file_(std::move(other.file_)),
        temporary_(std::exchange(other.temporary_, {})),
        unnamed_(other.unnamed_),
        fd_(std::move(other.fd_)),
        buffer_(std::move(other.buffer_)) {}

  Output& operator<<(std::string_view text) {
    if (buffer_.size() + text.size() > block) flush();
    buffer_ += text;
    return *this;
  }
  Output& operator<<(double x) { return number(x); }
  Output& operator<<(int x) { return number(x); }

  /// Everything is with the system afterwards, so that commit() can hardly fail.
  void finish() {
    flush();
    if (unnamed_) give_name();
    if (!fd_.close()) throw_system("cannot write", file_);
  }
  void commit() {
    if (temporary_.empty()) return;
    if (::rename(temporary_.c_str(), file_.c_str()) != 0) throw_system("cannot write", file_);
    temporary_.clear();
  }

 private:
  static bool is_of_the_system(const path& file) {
    return file.string().starts_with("/dev/") || file.string().starts_with("/proc/");
  }
  static path target(path file) {
    std::error_code ignored;
    for (int links = 0; links < 40 && std::filesystem::is_symlink(file, ignored); ++links) {
      if (is_of_the_system(file)) break;
      file = file.parent_path() / std::filesystem::read_symlink(file);
    }
    return file;
  }
  static path temporary(const path& file) {
    std::error_code ignored;
    const auto status = std::filesystem::status(file, ignored);
    const bool regular = std::filesystem::is_regular_file(status) && !is_of_the_system(file);
    if (std::filesystem::exists(status) && !regular) return {};
    path name = file;
    name += ".part" + std::to_string(::getpid());
    return name;
  }
  Descriptor open() {
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
  int open_unnamed() const {
#if defined(O_TMPFILE)
    const path folder = file_.has_parent_path() ? file_.parent_path() : ".";
    if (::access("/proc/self/fd", X_OK) == 0)
      return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
    return -1;
  }
  void give_name() {
    const std::string nameless = "/proc/self/fd/" + std::to_string(fd_.get());
    ::unlink(temporary_.c_str());  // of a program that was killed, if it had the same number
    if (::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) != 0)
      throw_system("cannot write", file_);
  }
  void flush() {
    std::string_view rest = buffer_;
    while (!rest.empty()) {
      const auto written = ::write(fd_.get(), rest.data(), rest.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) throw_system("cannot write", file_);
      rest.remove_prefix(static_cast<std::size_t>(written));
    }
    buffer_.clear();
  }
  template <class Number>
  Output& number(Number x) {
    char digits[32];
    return *this << std::string_view(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
  }

  path file_;
  path temporary_;
  bool unnamed_ = false;  // the temporary file gets its name when it is complete
  Descriptor fd_;
  std::string buffer_;
};

/// Calls write(output) on a new file, which then replaces the old one.
template <class Write>
void write_file(const path& file, const Write& write) {
  Output out(file);
  write(out);
  out.finish();
  out.commit();
}

/// The lines of a file, without their ends, whatever its size.
class Lines {
 public:
  explicit Lines(const path& file) : file_(file), fd_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_.get() < 0) throw_system("cannot read", file_);
    buffer_.resize(read_block);
  }

  /// The next line in `line`, valid until the next call; false at the end of the file.
  bool next(std::string_view& line) {
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

  /// Skips to the first line that begins at byte `offset` of the file or later.
  void skip_to(std::int64_t offset) {
    if (offset <= line_begin()) return;
    if (::lseek(fd_.get(), offset - 1, SEEK_SET) < 0) throw_system("cannot read", file_);
    skipped_ = read_ = offset - 1;
    begin_ = end_ = 0;
    at_end_ = false;
    number_ = 0;
    std::string_view rest_of_a_line;
    next(rest_of_a_line);
  }
  /// Where in the file the next line begins.
  std::int64_t line_begin() const { return read_ - static_cast<std::int64_t>(end_ - begin_); }
  /// How many bytes the file has.
  std::int64_t size() const {
    struct stat status;
    if (::fstat(fd_.get(), &status) != 0) throw_system("cannot read", file_);
    if (!S_ISREG(status.st_mode)) errno = ESPIPE, throw_system("cannot read a part of", file_);
    return status.st_size;
  }

  /// "file:line: ", for messages about the line last returned.
  std::string place() const {
    return file_.string() + ":" + std::to_string(lines_skipped() + number_) + ": ";
  }

 private:
  /// Moves the unfinished line to the front and reads on; returns where the new bytes begin.
  std::size_t refill() {
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
  std::int64_t lines_skipped() const {
    if (skipped_ == 0) return 0;
    Lines before(file_);
    std::string_view line;
    std::int64_t count = 0;
    while (before.line_begin() < skipped_ && before.next(line)) ++count;
    return count - (before.line_begin() > skipped_);
  }

  path file_;
  Descriptor fd_;
  std::string buffer_;
  std::size_t begin_ = 0, end_ = 0;  // of what has been read and not returned
  bool at_end_ = false;
  std::int64_t number_ = 0;              // of the lines that were read, after those skipped
  std::int64_t skipped_ = 0, read_ = 0;  // bytes
};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Calls visit(cell) for each cell of a line.
template <class Visit>
void for_each_cell(std::string_view line, const Visit& visit) {
  for (;;) {
    const auto comma = line.find(',');
    visit(trimmed(line.substr(0, comma)));
    if (comma == line.npos) return;
    line.remove_prefix(comma + 1);
  }
}

/// Whether text is UTF-8 without control characters: what XML and terminals can take.
bool is_text(std::string_view text) {
  int following = 0;
  for (const unsigned char c : text) {
    if (following > 0 ? (c & 0xC0) != 0x80
                      : (c < 0x20 && c != '\t') || c == 0x7F || (c & 0xC0) == 0x80 || c > 0xF7)
      return false;
    following = following > 0 ? following - 1 : c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : c >= 0xC0 ? 1 : 0;
  }
  return following == 0;
}

std::vector<std::string> header(std::string_view line, const std::string& place) {
  if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  if (line.starts_with('#')) line.remove_prefix(1);  // as numpy writes headers
  if (!is_text(line)) throw InvalidInput(place + "the header is not UTF-8 text");
  std::vector<std::string> names;
  for_each_cell(line, [&](std::string_view cell) {
    if (cell.size() >= 2 && cell.starts_with('"') && cell.ends_with('"'))
      cell = cell.substr(1, cell.size() - 2);
    if (cell.empty()) throw InvalidInput(place + "a column has no name");
    names.emplace_back(cell);
  });
  auto sorted = names;  // a line has room for 250,000 names
  std::ranges::sort(sorted);
  if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
    throw InvalidInput(place + "two columns are named '" + *twice + "'");
  return names;
}

/// A name as header() reads it back: in quotes if it would otherwise lose its blanks, quotes or #.
std::string header_cell(const std::string& name) {
  const bool quoted = name.size() >= 2 && name.starts_with('"') && name.ends_with('"');
  const bool marked = name.starts_with('#') || name.starts_with("\xEF\xBB\xBF");
  return quoted || marked || trimmed(name) != name ? '"' + name + '"' : name;
}

/// At most so much of a cell in a message that it stays readable.
std::string excerpt(std::string_view text) {
  std::string shown(text.substr(0, 40));
  std::ranges::replace_if(
      shown, [](unsigned char c) { return c < 0x20 || c > 0x7E; }, '?');
  return shown + (text.size() > 40 ? "..." : "");
}

void parse_row(std::string_view line, const std::vector<std::string>& names, const Lines& lines,
               std::vector<double>& values) {
  std::size_t columns = 0;
  for_each_cell(line, [&](std::string_view cell) {
    if (columns++ >= names.size()) return;
    std::string_view digits = cell;
    if (cell.starts_with('+') && !cell.starts_with("+-")) digits.remove_prefix(1);
    double x;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (error == std::errc::result_out_of_range)
      throw InvalidInput(lines.place() + "column '" + names[columns - 1] + "': " + excerpt(cell) +
                         " is beyond the range of a double");
    if (error != std::errc() || end != cell.data() + cell.size())
      throw InvalidInput(lines.place() + "column '" + names[columns - 1] + "': '" + excerpt(cell) +
                         "' is not a number");
    values.push_back(x);
  });
  if (columns != names.size())
    throw InvalidInput(lines.place() + std::to_string(columns) + " columns where the header has " +
                       std::to_string(names.size()));
}

/// Bytes in base 64 (RFC 4648), three at a time.
std::string base64(std::span<const std::byte> bytes) {
  static constexpr char digits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t triple = 0;
    for (std::size_t k = 0; k < 3; ++k)
      triple = triple << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? digits[triple >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A VTK data array: its size in bytes, then the bytes.
template <class T>
void write_array(Output& out, std::string_view attributes, const std::vector<T>& values) {
  const std::uint64_t size = values.size() * sizeof(T);
  out << "<DataArray " << attributes << " format=\"binary\">"
      << base64(std::as_bytes(std::span(&size, 1))) << base64(std::as_bytes(std::span(values)))
      << "</DataArray>\n";
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

constexpr std::array<std::string_view, 3> axis_names = {"x", "y", "z"};

void write_entries(Output& out, const SparseMatrix& matrix) {
  out << "%%MatrixMarket matrix coordinate real general\n"
      << static_cast<int>(matrix.rows()) << " " << static_cast<int>(matrix.cols()) << " "
      << static_cast<int>(matrix.nonZeros()) << "\n";
  for (int i = 0; i < matrix.rows(); ++i)
    for (SparseMatrix::InnerIterator entry(matrix, i); entry; ++entry)
      out << i + 1 << " " << static_cast<int>(entry.col()) + 1 << " " << entry.value() << "\n";
}

/// The words of a line, which blanks part.
std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  for (line = trimmed(line); !line.empty();) {
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    result.push_back(line.substr(0, end));
    line = trimmed(line.substr(end));
  }
  return result;
}

double number(std::string_view word, const std::string& place) {
  double x;
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(x))
    throw InvalidInput(place + "'" + excerpt(word) + "' is not a finite number");
  return x;
}
int whole_number(std::string_view word, int least, int most, const std::string& place) {
  int n;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), n);
  if (error != std::errc() || end != word.data() + word.size() || n < least || n > most)
    throw InvalidInput(place + "'" + excerpt(word) + "' is not a whole number from " +
                       std::to_string(least) + " to " + std::to_string(most));
  return n;
}

/// Each row takes memory, whether it has entries or not, so that a file of a hundred bytes must not ask for
/// two thousand million of them: see read_matrix_market().
constexpr int few_rows = 10'000'000, rows_per_entry = 10;

/// What the first line of a Matrix Market file says.
struct MarketHeader {
  bool pattern = false;
  int mirrored = 0;  // 1: symmetric, -1: skew-symmetric
};
MarketHeader market_header(std::string_view line, const std::string& place) {
  std::string lower(line.substr(0, 200));
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  const auto w = words(lower);
  if (w.size() != 5 || w[0] != "%%matrixmarket" || w[1] != "matrix" || w[2] != "coordinate")
    throw InvalidInput(place + "expected '%%MatrixMarket matrix coordinate ..', not '" +
                       excerpt(line) + "'");
  if (w[3] != "real" && w[3] != "integer" && w[3] != "pattern")
    throw InvalidInput(place + "numbers must be real, integer or pattern, not " + excerpt(w[3]));
  if (w[4] != "general" && w[4] != "symmetric" && w[4] != "skew-symmetric")
    throw InvalidInput(place + "the matrix must be general, symmetric or skew-symmetric, not " +
                       excerpt(w[4]));
  return {w[3] == "pattern", w[4] == "symmetric" ? 1 : w[4] == "general" ? 0 : -1};
}

using Entry = Eigen::Triplet<double, int>;

/// The entries as rows, sorted; none twice. Takes memory for rows and entries, not for columns.
SparseMatrix matrix_of(std::vector<Entry> entries, int rows, int columns, const path& file) {
  const auto place = [](const Entry& e) { return std::pair(e.row(), e.col()); };
  if (!std::ranges::is_sorted(entries, {}, place)) std::ranges::sort(entries, {}, place);
  if (const auto twice = std::ranges::adjacent_find(entries, {}, place); twice != entries.end())
    throw InvalidInput(file.string() + ": entry (" + std::to_string(twice->row() + 1) + ", " +
                       std::to_string(twice->col() + 1) + ") is there twice");
  SparseMatrix matrix(rows, columns);
  matrix.resizeNonZeros(std::ssize(entries));
  int* const outer = matrix.outerIndexPtr();
  for (std::size_t k = 0; k < entries.size(); ++k) {
    ++outer[entries[k].row() + 1];
    matrix.innerIndexPtr()[k] = entries[k].col();
    matrix.valuePtr()[k] = entries[k].value();
  }
  std::partial_sum(outer, outer + rows + 1, outer);
  return matrix;
}

Eigen::Index place_of(std::string_view name, const Table& table) {
  const auto found = std::ranges::find(table.names, name);
  if (found == table.names.end()) throw_unknown("column", name, table.names);
  return found - table.names.begin();
}

void check_length(std::string_view name, const Eigen::VectorXd& column, const Table& table) {
  if (column.size() != table.values.rows())
    throw InvalidInput("column '" + std::string(name) + "' has " + std::to_string(column.size()) +
                       " entries, the table has " + std::to_string(table.values.rows()) + " rows");
}

}  // namespace

bool Table::has(std::string_view name) const {
  return std::ranges::find(names, name) != names.end();
}

Eigen::VectorXd Table::column(std::string_view name) const {
  return values.col(place_of(name, *this));
}

void Table::set(std::string_view name, const Eigen::VectorXd& column) {
  check_length(name, column, *this);
  values.col(place_of(name, *this)) = column;
}

void Table::add(const std::string& name, const Eigen::VectorXd& column) {
  if (has(name)) throw InvalidInput("there is already a column '" + name + "'");
  if (names.empty()) values.resize(column.size(), 0);
  check_length(name, column, *this);
  std::vector<std::string> more = names;  // names and values change together or not at all
  more.push_back(name);
  values.conservativeResize(Eigen::NoChange, values.cols() + 1);
  names.swap(more);
  values.rightCols<1>() = column;
}

Table Table::select(const std::vector<int>& rows) const {
  return {names, values(rows, Eigen::all)};
}

Table read_csv(const path& file) { return read_csv(file, 0, 1); }

Table read_csv(const path& file, int part, int parts) {
  if (part < 0 || part >= parts)
    throw InvalidInput("there is no part " + std::to_string(part) + " of " + std::to_string(parts));
  Lines lines(file);
  const std::int64_t size = parts > 1 ? lines.size() : 0;  // a pipe is refused before it is read
  std::string_view line;
  if (!lines.next(line) || trimmed(line).empty())
    throw InvalidInput(file.string() + ":1: expected a header row such as x,y,volume");
  Table table;
  table.names = header(line, lines.place());

  // A line belongs to the part in which it begins.
  std::int64_t end = std::numeric_limits<std::int64_t>::max();
  if (parts > 1) {
    const std::int64_t first = lines.line_begin(), bytes = std::max<std::int64_t>(size - first, 0);
    const auto begin_of = [&](int p) {
      return first + bytes / parts * p + bytes % parts * p / parts;
    };
    lines.skip_to(begin_of(part));
    if (part < parts - 1) end = begin_of(part + 1);
  }

  std::vector<double> values;  // row by row
  std::string blank;           // where an empty line stands, allowed only at the end
  while ((lines.line_begin() < end || !blank.empty()) && lines.next(line)) {
    if (trimmed(line).empty()) {
      if (blank.empty()) blank = lines.place();
      continue;
    }
    if (!blank.empty()) throw InvalidInput(blank + "the line is empty");
    parse_row(line, table.names, lines, values);
  }
  const auto columns = static_cast<Eigen::Index>(table.names.size());
  table.values = Eigen::Map<const Positions>(
      values.data(), static_cast<Eigen::Index>(values.size()) / columns, columns);
  return table;
}

Cloud make_cloud(const Table& table, CloudOptions options) {
  const auto dimension = std::ranges::count_if(axis_names, [&](auto a) { return table.has(a); });
  Positions x(table.values.rows(), std::max<std::ptrdiff_t>(dimension, 1));
  // With k coordinates these are the first k, so that a z without y is an unknown column y.
  for (Eigen::Index a = 0; a < x.cols(); ++a) {
    const Eigen::VectorXd column = table.column(axis_names[a]);
    if (column.size() > 0) x.col(a) = column;  // without points there is no memory to point into
  }
  if (table.has("volume")) options.volumes = table.column("volume");
  return Cloud(std::move(x), std::move(options));
}

Cloud read_cloud(const path& file) { return make_cloud(read_csv(file)); }

void write_text(const path& file, std::string_view text) {
  write_file(file, [&](Output& out) { out << text; });
}

namespace {

const char* separator(Eigen::Index column, const Table& table) {
  return column + 1 < table.values.cols() ? "," : "\n";
}

void write_header(Output& out, const Table& table) {
  for (Eigen::Index c = 0; c < table.values.cols(); ++c)
    out << header_cell(table.names[c]) << separator(c, table);
}

void write_rows(Output& out, const Table& table) {
  for (Eigen::Index i = 0; i < table.values.rows(); ++i)
    for (Eigen::Index c = 0; c < table.values.cols(); ++c)
      out << table.values(i, c) << separator(c, table);
}

}  // namespace

void write_csv(const path& file, const Table& table) {
  write_file(file, [&](Output& out) {
    write_header(out, table);
    write_rows(out, table);
  });
}

void write_csv(const path& file, const std::function<bool(Table&)>& next) {
  write_file(file, [&](Output& out) {
    Table table;
    for (bool first = true; next(table); first = false) {
      if (first) write_header(out, table);
      write_rows(out, table);
    }
  });
}

void write_vtu(const path& file, const Table& table) {
  const auto n = static_cast<std::size_t>(table.values.rows());
  std::vector<double> points(3 * n, 0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    if (a > 0 && !table.has(axis_names[a])) continue;
    const Eigen::VectorXd x = table.column(axis_names[a]);
    for (std::size_t i = 0; i < n; ++i) points[3 * i + a] = x[i];
  }
  std::vector<std::int32_t> vertices(n), ends(n);
  for (std::size_t i = 0; i < n; ++i) vertices[i] = i, ends[i] = i + 1;
  const std::vector<std::uint8_t> types(n, 1);  // VTK_VERTEX

  write_file(file, [&](Output& out) {
    const auto count = std::to_string(n);
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\""
        << " byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n"
        << "<Piece NumberOfPoints=\"" << count << "\" NumberOfCells=\"" << count << "\">\n"
        << "<PointData>\n";
    for (std::size_t c = 0; c < table.names.size(); ++c) {
      if (std::ranges::find(axis_names, table.names[c]) != axis_names.end()) continue;
      const auto column = table.values.col(static_cast<Eigen::Index>(c));
      write_array(out, "type=\"Float64\" Name=\"" + escaped(table.names[c]) + "\"",
                  std::vector<double>(column.begin(), column.end()));
    }
    out << "</PointData>\n<Points>\n";
    write_array(out, "type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", points);
    out << "</Points>\n<Cells>\n";
    write_array(out, "type=\"Int32\" Name=\"connectivity\"", vertices);
    write_array(out, "type=\"Int32\" Name=\"offsets\"", ends);
    write_array(out, "type=\"UInt8\" Name=\"types\"", types);
    out << "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  });
}

void write_pvtu(const path& file, const std::vector<std::string>& names,
                const std::vector<path>& pieces) {
  write_file(file, [&](Output& out) {
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\""
        << " byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        << "<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n";
    for (const std::string& name : names)
      if (std::ranges::find(axis_names, name) == axis_names.end())
        out << "<PDataArray type=\"Float64\" Name=\"" << escaped(name) << "\"/>\n";
    out << "</PPointData>\n<PPoints>\n"
        << "<PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n</PPoints>\n";
    for (const path& piece : pieces)
      out << "<Piece Source=\"" << escaped(piece.filename().string()) << "\"/>\n";
    out << "</PUnstructuredGrid>\n</VTKFile>\n";
  });
}

void write_pvd(const path& file, const std::vector<std::pair<double, path>>& series) {
  write_file(file, [&](Output& out) {
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n";
    for (const auto& [time, member] : series)
      out << "<DataSet timestep=\"" << time << "\" file=\"" << escaped(member.filename().string())
          << "\"/>\n";
    out << "</Collection>\n</VTKFile>\n";
  });
}

void write_matrix_market(const path& file, const SparseMatrix& matrix) {
  write_file(file, [&](Output& out) { write_entries(out, matrix); });
}

void write_matrix_market(const std::vector<path>& files,
                         const std::vector<SparseMatrix>& matrices) {
  if (files.size() != matrices.size())
    throw InvalidInput(std::to_string(files.size()) + " files for " +
                       std::to_string(matrices.size()) + " matrices");
  std::vector<Output> outputs;
  for (std::size_t k = 0; k < files.size(); ++k) {
    outputs.emplace_back(files[k]);
    write_entries(outputs.back(), matrices[k]);
    outputs.back().finish();
  }
  for (Output& out : outputs) out.commit();
}

SparseMatrix read_matrix_market(const path& file) {
  Lines lines(file);
  std::string_view line;
  if (!lines.next(line)) throw InvalidInput(file.string() + ":1: the file is empty");
  const MarketHeader header = market_header(line, lines.place());
  const auto next_words = [&] {  // of the next line that is not a comment; none at the end
    while (lines.next(line)) {
      if (line.starts_with('%')) continue;
      if (auto w = words(line); !w.empty()) return w;
    }
    return std::vector<std::string_view>();
  };
  constexpr int most = std::numeric_limits<int>::max();
  const auto sizes = next_words();
  if (sizes.size() != 3) throw InvalidInput(lines.place() + "expected ROWS COLUMNS ENTRIES");
  const int rows = whole_number(sizes[0], 0, most - 1, lines.place());
  const int columns = whole_number(sizes[1], 0, most - 1, lines.place());
  const int announced = whole_number(sizes[2], 0, most, lines.place());
  if (rows > few_rows && rows / rows_per_entry > announced)
    throw InvalidInput(lines.place() + std::to_string(rows) + " rows for " +
                       std::to_string(announced) + " entries: above " + std::to_string(few_rows) +
                       " rows there must be an entry for every " + std::to_string(rows_per_entry));
  if (header.mirrored != 0 && rows != columns)
    throw InvalidInput(lines.place() + "a symmetric matrix must be square");

  std::vector<Entry> entries;  // grows with what is read, not with what is announced
  int count = 0;
  for (auto w = next_words(); !w.empty(); w = next_words()) {
    const std::string place = lines.place();
    if (count++ == announced)
      throw InvalidInput(place + "more entries than the " + std::to_string(announced) +
                         " announced");
    if (w.size() != (header.pattern ? 2 : 3))
      throw InvalidInput(place + "expected ROW COLUMN" + (header.pattern ? "" : " VALUE"));
    const int i = whole_number(w[0], 1, rows, place) - 1;
    const int j = whole_number(w[1], 1, columns, place) - 1;
    const double value = header.pattern ? 1 : number(w[2], place);
    if (header.mirrored != 0 && j > i)
      throw InvalidInput(place + "only the lower triangle of a symmetric matrix is stored");
    if (header.mirrored < 0 && j == i)
      throw InvalidInput(place + "a skew-symmetric matrix has no diagonal");
    entries.emplace_back(i, j, value);
    if (header.mirrored != 0 && i != j) entries.emplace_back(j, i, header.mirrored * value);
    if (entries.size() > most)
      throw InvalidInput(place + "the matrix has more than 2^31 - 1 entries");
  }
  if (count < announced)
    throw InvalidInput(file.string() + ": " + std::to_string(count) + " entries where " +
                       std::to_string(announced) + " are announced");
  return matrix_of(std::move(entries), rows, columns, file);
}

}  // namespace gradpsi
