#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <locale>
#include <system_error>

#include "io/files.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;
using Fault28 = Files;
using Fault29 = Files;
using Write = Files;

TEST_F(Fault28, AnUnwritableFolderIsNamed) {
  EXPECT_THAT(message_of<std::system_error>([&] { write_text(path("no/file"), "text"); }),
              HasSubstr("cannot write " + path("no/file").string()));
}

TEST_F(Fault28, AFullDiskIsAnErrorAndTheOldFileSurvives) {
  EXPECT_THROW(write_text("/dev/full", "text"), std::system_error);
  // A limit on the size of files stands in for a full disk.
  write_text(path("old"), "old");
  const auto write_beyond_the_limit = [&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_text(path("old"), std::string(1 << 20, 'x'));
    } catch (const std::system_error& e) {
      std::_Exit(e.code().value() == EFBIG ? 3
                                           : 4);  // a thread sanitizer would look at what forked
    }
  };
  EXPECT_EXIT(write_beyond_the_limit(), testing::ExitedWithCode(3), "");
  EXPECT_EQ(content(path("old")), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(Write, LinksAreFollowedAndPermissionsKept) {
  write_text(path("real"), "old");
  fs::permissions(path("real"), fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("real", path("link"));
  write_text(path("link"), "new");
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(content(path("real")), "new");
  EXPECT_EQ(fs::status(path("real")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

// As `program -o /dev/stdout > file` does, where the link must not become a file.
TEST_F(Write, ALinkToAnOpenFileIsWrittenThrough) {
  std::FILE* const open = std::fopen(path("real").c_str(), "w");
  fs::create_symlink("/proc/self/fd/" + std::to_string(fileno(open)), path("link"));
  write_text(path("link"), "text");
  std::fclose(open);
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(content(path("real")), "text");
}

TEST_F(Fault29, ADecimalCommaLocaleChangesNothing) {
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  Table table{{"x"}, Eigen::MatrixXd::Constant(1, 1, 12345.5)};
  write_csv(path("out.csv"), table);
  const Table back = read_csv(path("out.csv"));
  SparseMatrix matrix(2000, 2000);
  matrix.insert(1999, 1999) = 0.5;
  write_matrix_market(path("out.mtx"), matrix);
  std::locale::global(before);
  EXPECT_EQ(content(path("out.csv")), "x\n12345.5\n");
  EXPECT_EQ(back.values(0, 0), 12345.5);
  EXPECT_THAT(content(path("out.mtx")), HasSubstr("\n2000 2000 1\n2000 2000 0.5\n"));
}

}  // namespace
}  // namespace gradpsi
