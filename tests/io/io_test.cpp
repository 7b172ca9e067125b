#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <locale>
#include <sstream>
#include <system_error>

#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

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

using Csv = Files;
using Fault27 = Files;
using Fault28 = Files;
using Fault29 = Files;
using Write = Files;
using Market = Files;

TEST_F(Csv, GivesPointsVolumesAndFields) {
  const Table table = read_csv(file("x,T,y,volume\n0.5,1,2,1\n-1e-3,2,3,2.5\n"));
  EXPECT_THAT(table.names, ElementsAre("x", "T", "y", "volume"));
  EXPECT_EQ(table.column("T")[1], 2);
  const Cloud cloud = make_cloud(table);
  EXPECT_EQ(cloud.dimension(), 2);
  EXPECT_EQ(cloud.positions()(1, 0), -1e-3);
  EXPECT_EQ(cloud.positions()(1, 1), 3);
  EXPECT_EQ(cloud.volumes()[1], 2.5);
}

TEST_F(Csv, AcceptsWhatOtherProgramsWrite) {
  // Byte-order mark, CRLF, quoted names, blanks, plus signs, empty lines at the end.
  EXPECT_EQ(read_cloud(file("\xEF\xBB\xBF\"x\" , y\r\n +1 ,2\r\n3,4\r\n\r\n")).positions(),
            (Positions(2, 2) << 1, 2, 3, 4).finished());
  EXPECT_EQ(read_cloud(file("x\n1\n2")).size(), 2);  // no line end at the end
  EXPECT_THAT(read_csv(file("# x,T\n1,2\n")).names, ElementsAre("x", "T"));  // numpy.savetxt
}

// Found by a fuzzer: written bare, these came back as other names.
TEST_F(Csv, NamesThatNeedQuotesSurvive) {
  const Table table{{"#x", "\"y\"", " T", "\"", "\xEF\xBB\xBFp", "a b"},
                    Eigen::MatrixXd::Random(2, 6)};
  write_csv(path("t.csv"), table);
  EXPECT_EQ(read_csv(path("t.csv")).names, table.names);
  EXPECT_THAT(content(path("t.csv")), HasSubstr(",\",\""));  // only where they are needed
  EXPECT_THAT(content(path("t.csv")), HasSubstr(",a b\n"));
}

TEST_F(Csv, AHeaderAloneIsNoPoints) {
  const Cloud cloud = read_cloud(file("x,y,z\n"));
  EXPECT_EQ(cloud.size(), 0);
  EXPECT_EQ(cloud.dimension(), 3);
}

TEST_F(Csv, ReadsFilesLargerThanItsBuffer) {
  std::string text = "x\n";
  for (int i = 0; i < 400'000; ++i) text += std::to_string(i) + '\n';
  const Cloud cloud = read_cloud(file(text));
  ASSERT_EQ(cloud.size(), 400'000);
  EXPECT_EQ(cloud.positions(), Positions(Eigen::VectorXd::LinSpaced(400'000, 0, 399'999)));
}

TEST(Fault15, AnUnknownColumnIsAnsweredWithTheNearestFirst) {
  const Table table{{"x", "temperature", "pressure"}, Eigen::MatrixXd::Ones(1, 3)};
  EXPECT_THAT(message_of<InvalidInput>([&] { table.column("temprature"); }),
              HasSubstr("unknown column 'temprature'; valid: temperature, "));
}

TEST_F(Csv, PositionsMustBeXThenYThenZ) {
  EXPECT_THAT(error("a,b\n1,2\n"), HasSubstr("unknown column 'x'"));
  EXPECT_THAT(error("x,z\n1,2\n"), HasSubstr("unknown column 'y'"));
}

TEST_F(Csv, PartsAreTheRowsOfTheWholeEachOnce) {
  for (const std::string ends : {"\n", "\r\n"}) {
    std::string text = "x,T" + ends;
    for (int i = 0; i < 23; ++i)
      text += std::to_string(i) + "," + std::string(1 + i * i % 7, '9') + ends;
    for (const std::string& tail : {std::string(), ends + ends, "5,5" + ends, std::string("6,6")}) {
      const fs::path name = file(text + tail);
      const Eigen::MatrixXd whole = read_csv(name).values;
      for (const int parts : {1, 2, 3, 7, 23, 24, 200}) {
        Eigen::Index row = 0;
        for (int part = 0; part < parts; ++part) {
          const Table table = read_csv(name, part, parts);
          EXPECT_THAT(table.names, ElementsAre("x", "T"));
          ASSERT_LE(row + table.values.rows(), whole.rows());
          EXPECT_EQ(table.values, whole.middleRows(row, table.values.rows()));
          row += table.values.rows();
        }
        EXPECT_EQ(row, whole.rows());
      }
    }
  }
  EXPECT_THROW(read_csv(file("x\n1\n"), 2, 2), InvalidInput);
  EXPECT_THROW(read_csv(file("x\n1\n"), -1, 2), InvalidInput);
}

TEST_F(Fault27, PartsNameTheLineOfTheWholeFile) {
  std::string text = "x\n";
  for (int i = 0; i < 40; ++i) text += std::to_string(i) + "\n";
  for (const std::string bad : {"1,2", "", "one"}) {
    std::string broken = text + bad + "\n" + text.substr(2);
    const std::string whole = error(broken);
    EXPECT_THAT(whole, HasSubstr(":42: "));
    for (const int parts : {2, 5, 81}) {
      int errors = 0;
      for (int part = 0; part < parts; ++part) try {
          read_csv(file(broken), part, parts);
        } catch (const InvalidInput& failure) {
          EXPECT_EQ(failure.what(), whole);
          ++errors;
        }
      EXPECT_EQ(errors, 1);
    }
  }
}

TEST_F(Fault27, BadPointsNameTheLine) {
  EXPECT_THAT(error(""), HasSubstr("points.csv:1: expected a header row"));
  EXPECT_THAT(error("\n1\n"), HasSubstr(":1: expected a header row"));
  EXPECT_THAT(error("\xEF\xBB\xBFx\r\n1\r\none\r\n"), HasSubstr(":3: column 'x': 'one' is not"));
  EXPECT_THAT(error("x,y\n1,2\n1\n"), HasSubstr(":3: 1 columns where the header has 2"));
  EXPECT_THAT(error("x,y\n1,2\n1,2,3\n"), HasSubstr(":3: 3 columns where the header has 2"));
  EXPECT_THAT(error("x,y\n1,2\n3,4\n5,"), HasSubstr(":4: column 'y': '' is not a number"));
  EXPECT_THAT(error("x,y\n1,2\n3,four\n"), HasSubstr(":3: column 'y': 'four' is not a number"));
  EXPECT_THAT(error("x\n1.5e\n"), HasSubstr(":2: column 'x': '1.5e' is not a number"));
  EXPECT_THAT(error("x\n+-1\n"), HasSubstr("'+-1' is not a number"));
  EXPECT_THAT(error("x\n0x10\n"), HasSubstr("'0x10' is not a number"));
  EXPECT_THAT(error("x\n1e999\n"), HasSubstr(":2: column 'x': 1e999 is beyond the range"));
  EXPECT_THAT(error("x\n1\n\n2\n"), HasSubstr(":3: the line is empty"));
  EXPECT_THAT(error("x,x\n1,2\n"), HasSubstr(":1: two columns are named 'x'"));
  EXPECT_THAT(error("x,\n1,2\n"), HasSubstr(":1: a column has no name"));
  // A decimal comma makes a column more, a semicolon none.
  EXPECT_THAT(error("x,y\n1,5,2,5\n"), HasSubstr(":2: 4 columns"));
  EXPECT_THAT(error("x;y\n1;2\n"), HasSubstr(":2: column 'x;y': '1;2' is not a number"));
}

TEST_F(Fault27, AHeaderThatIsNotTextIsRefused) {
  for (const std::string header : {"x,T\xe9", "x,T\x01", "\xff\xfex", "x,\xc3"})
    EXPECT_THAT(error(header + "\n1,2\n"), HasSubstr(":1: the header is not UTF-8 text"));
  EXPECT_EQ(read_csv(file("x,\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\n1,2\n")).names[1].size(), 9u);
  EXPECT_THAT(error("x\n\x01\n"), HasSubstr(":2: column 'x': '?' is not a number"));
}

TEST_F(Fault27, ALongLineIsRefusedWithoutReadingItAll) {
  EXPECT_THAT(error("x\n1\n" + std::string(3 << 20, '7')),
              HasSubstr(":3: the line is longer than 1048576 bytes"));
}

TEST_F(Fault27, AHeaderOfAMegabyteIsReadAtOnce) {
  std::string names = "x";
  for (int k = 0; k < 150'000; ++k) names += "," + std::to_string(k);
  EXPECT_EQ(read_csv(file(names + "\n")).names.size(), 150'001u);
  EXPECT_THAT(error(names + ",77777\n"), HasSubstr(":1: two columns are named '77777'"));
}

TEST_F(Fault27, NanInACoordinateNamesThePoint) {
  EXPECT_THAT(error("x\n1\nnan\n"), HasSubstr("point 1 has coordinates (nan)"));
}

TEST_F(Fault27, AFileThatCannotBeReadIsNamed) {
  EXPECT_THAT(message_of<std::system_error>([&] { read_csv(path("none.csv")); }),
              HasSubstr("cannot read " + path("none.csv").string()));
  EXPECT_THROW(read_csv(path("")), std::system_error);  // a folder
}

TEST_F(Write, CsvReadsBackToTheLastBit) {
  Table table{{"x", "T"}, Eigen::MatrixXd(4, 2)};
  table.values << 0.1, 1.0 / 3, -1e-300, 5e-324, 1e22, std::numeric_limits<double>::max(), 7, -0.0;
  write_csv(path("out.csv"), table);
  const Table back = read_csv(path("out.csv"));
  EXPECT_EQ(back.names, table.names);
  EXPECT_EQ(back.values, table.values);
  EXPECT_EQ(files(), 1);  // nothing temporary remains
}

TEST_F(Write, CsvInPiecesIsTheWhole) {
  const Table whole{{"x", "u"}, Eigen::MatrixXd::Random(10, 2)};
  for (const std::vector<int>& sizes : {std::vector{10}, {3, 0, 7}, {0, 10, 0}}) {
    int piece = 0, row = 0;
    write_csv(path("pieces.csv"), [&](Table& table) {
      if (piece == std::ssize(sizes)) return false;
      table = {whole.names, whole.values.middleRows(row, sizes[piece])};
      row += sizes[piece++];
      return true;
    });
    write_csv(path("whole.csv"), whole);
    EXPECT_EQ(content(path("pieces.csv")), content(path("whole.csv")));
  }
}

TEST_F(Write, PvtuNamesFieldsAndPieces) {
  write_pvtu(path("a.pvtu"), {"x", "y", "T <K>"}, {path("a_rank0.vtu"), path("a_rank1.vtu")});
  const std::string text = content(path("a.pvtu"));
  EXPECT_THAT(text, HasSubstr("<PDataArray type=\"Float64\" Name=\"T &lt;K>\"/>"));
  EXPECT_THAT(text, testing::Not(HasSubstr("Name=\"y\"")));
  EXPECT_THAT(text, HasSubstr("<Piece Source=\"a_rank0.vtu\"/>\n<Piece Source=\"a_rank1.vtu\"/>"));
}

TEST_F(Write, MatrixMarketHoldsEveryEntryOnce) {
  const Cloud cloud = irregular_cloud(2, 6);
  const SparseMatrix matrix =
      assemble("laplacian-mixed-soc", cloud, find_neighbours(cloud, 0.6)).matrix();
  write_matrix_market(path("a.mtx"), matrix);
  std::istringstream in(content(path("a.mtx")));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "%%MatrixMarket matrix coordinate real general");
  int rows, cols, entries;
  in >> rows >> cols >> entries;
  EXPECT_EQ(rows, 36);
  EXPECT_EQ(cols, 36);
  ASSERT_EQ(entries, matrix.nonZeros());
  SparseMatrix back = matrix;
  int i, j, count = 0;
  for (std::string value; in >> i >> j >> value; ++count) {
    EXPECT_EQ(std::stod(value), matrix.coeff(i - 1, j - 1));
    back.coeffRef(i - 1, j - 1) = 0;
  }
  EXPECT_EQ(count, entries);
  EXPECT_EQ(back.norm(), 0);
}

TEST_F(Market, ReadsBackToTheLastBit) {
  const Cloud cloud = irregular_cloud(2, 12);
  const SparseMatrix A =
      assemble("laplacian-mixed-soc", cloud, find_neighbours(cloud, rich_support(cloud))).matrix();
  write_matrix_market(path("A.mtx"), A);
  const SparseMatrix B = read_matrix_market(path("A.mtx"));
  EXPECT_EQ(SparseMatrix(A - B).norm(), 0);
  EXPECT_EQ(B.nonZeros(), A.nonZeros());
}

TEST_F(Market, ReadsWhatOtherProgramsWrite) {
  const auto read = [&](const std::string& text) {
    return Eigen::MatrixXd(read_matrix_market(file(text)));
  };
  const std::string banner = "%%MatrixMarket matrix coordinate ";
  EXPECT_EQ(read(banner + "real general\n% comment\n\n2 3 2\r\n2 3 -1.5e0\n1 1 +2\n"),
            (Eigen::MatrixXd(2, 3) << 2, 0, 0, 0, 0, -1.5).finished());
  EXPECT_EQ(read(banner + "integer symmetric\n2 2 2\n2 1 4\n2 2 5\n"),
            (Eigen::MatrixXd(2, 2) << 0, 4, 4, 5).finished());
  EXPECT_EQ(read(banner + "REAL skew-symmetric\n2 2 1\n2 1 4\n"),
            (Eigen::MatrixXd(2, 2) << 0, -4, 4, 0).finished());
  EXPECT_EQ(read(banner + "pattern general\n1 2 1\n1\t2"),
            (Eigen::MatrixXd(1, 2) << 0, 1).finished());
  EXPECT_EQ(read(banner + "real general\n0 0 0\n").size(), 0);
}

TEST_F(Fault27, BadMatricesNameTheLine) {
  const auto error = [&](const std::string& text) {
    return message_of<InvalidInput>([&] { read_matrix_market(file(text)); });
  };
  const std::string banner = "%%MatrixMarket matrix coordinate real general\n";
  EXPECT_THAT(error(""), HasSubstr("points.csv:1: the file is empty"));
  EXPECT_THAT(error("x,y\n1,2\n"), HasSubstr(":1: expected '%%MatrixMarket matrix coordinate"));
  EXPECT_THAT(error("%%MatrixMarket matrix array real general\n"), HasSubstr(":1: expected"));
  EXPECT_THAT(error("%%MatrixMarket matrix coordinate complex general\n"),
              HasSubstr("real, integer or pattern, not complex"));
  EXPECT_THAT(error("%%MatrixMarket matrix coordinate real hermitian\n"),
              HasSubstr("not hermitian"));
  EXPECT_THAT(error(banner + "2 2\n"), HasSubstr(":2: expected ROWS COLUMNS ENTRIES"));
  EXPECT_THAT(error(banner + "2 -2 1\n"), HasSubstr(":2: '-2' is not a whole number"));
  EXPECT_THAT(error(banner + "2 2 99999999999\n"), HasSubstr("'99999999999' is not a whole"));
  EXPECT_THAT(error(banner + "2 2 1\n3 1 1\n"), HasSubstr(":3: '3' is not a whole number from 1"));
  EXPECT_THAT(error(banner + "2 2 1\n0 1 1\n"), HasSubstr(":3: '0'"));
  EXPECT_THAT(error(banner + "2 2 1\n1 1 nan\n"), HasSubstr(":3: 'nan' is not a finite number"));
  EXPECT_THAT(error(banner + "2 2 1\n1 1 1e999\n"), HasSubstr(":3: '1e999'"));
  EXPECT_THAT(error(banner + "2 2 1\n1 1\n"), HasSubstr(":3: expected ROW COLUMN VALUE"));
  EXPECT_THAT(error(banner + "2 2 1\n1 1 1\n1 2 1\n"), HasSubstr(":4: more entries than the 1"));
  EXPECT_THAT(error(banner + "2 2 2000000000\n1 1 1\n"),
              HasSubstr("1 entries where 2000000000 are announced"));
  EXPECT_THAT(error(banner + "2 2 2\n2 1 1\n2 1 2\n"), HasSubstr("entry (2, 1) is there twice"));
  EXPECT_THAT(error("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n1 2 1\n"),
              HasSubstr(":3: only the lower triangle"));
  EXPECT_THAT(error("%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n2 1 1\n"),
              HasSubstr(":2: a symmetric matrix must be square"));
  EXPECT_THROW(read_matrix_market(path("absent.mtx")), std::system_error);
  // A decimal comma, text, a byte-order mark, CRLF, a truncated file, a line without an end.
  EXPECT_THAT(error(banner + "2 2 1\n1 1 1,5\n"), HasSubstr(":3: '1,5' is not a finite number"));
  EXPECT_THAT(error(banner + "2 2 1\n1 one 1\n"), HasSubstr(":3: 'one' is not a whole number"));
  EXPECT_THAT(error("\xEF\xBB\xBF" + banner + "0 0 0\n"), HasSubstr(":1: expected '%%Matrix"));
  EXPECT_THAT(error("%%MatrixMarket matrix coordinate real general\r\n2 2 1\r\n1 1 x\r\n"),
              HasSubstr(":3: 'x' is not a finite number"));
  EXPECT_THAT(error(banner + "2 2 3\n1 1 1\n1 2 1\n2 "),
              HasSubstr(":5: expected ROW COLUMN VALUE"));
  EXPECT_THAT(error(banner + "2 2 3\n1 1 1\n1 2 1\n"),
              HasSubstr("2 entries where 3 are announced"));
  for (const char* before : {"%", ""})
    EXPECT_THAT(error(banner + before + std::string(3 << 20, '7')),
                HasSubstr(":2: the line is longer than 1048576 bytes"));
}

// Memory is taken for rows, with or without entries: not for more than the file can stand for.
TEST_F(Fault27, RowsWithoutEntriesTakeNoMemoryToSpeakOf) {
  const std::string banner = "%%MatrixMarket matrix coordinate real general\n";
  for (const char* sizes : {"2000000000 3 0", "2000000000 2000000000 1", "2000000000 3 199999999"})
    EXPECT_THAT(
        message_of<InvalidInput>([&] { read_matrix_market(file(banner + sizes + "\n1 1 1\n")); }),
        HasSubstr(":2: 2000000000 rows for "));
  // Rows of a subset of many points.
  const SparseMatrix wide =
      read_matrix_market(file(banner + "2 2000000000 2\n1 7 5\n2 2000000000 6\n"));
  EXPECT_EQ(wide.cols(), 2'000'000'000);
  EXPECT_EQ(wide.coeff(0, 6), 5);
  EXPECT_EQ(wide.coeff(1, 1'999'999'999), 6);
  EXPECT_EQ(read_matrix_market(file(banner + "10000000 1 0\n")).rows(), 10'000'000);
}

TEST_F(Write, SeveralMatricesAreReplacedTogetherOrNotAtAll) {
  const std::vector<SparseMatrix> two(2, SparseMatrix(3, 3));
  write_text(path("a.mtx"), "old");
  EXPECT_THROW(write_matrix_market({path("a.mtx"), path("none/b.mtx")}, two), std::system_error);
  EXPECT_EQ(content(path("a.mtx")), "old");
  EXPECT_EQ(files(), 1);
  EXPECT_THROW(write_matrix_market({path("a.mtx")}, two), InvalidInput);
}

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
      std::exit(e.code().value() == EFBIG ? 3 : 4);
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

TEST_F(Write, VtuNeedsAPositionAndHoldsTheFields) {
  EXPECT_THROW(write_vtu(path("a.vtu"), Table{{"T"}, Eigen::MatrixXd::Zero(2, 1)}), InvalidInput);
  write_vtu(path("a.vtu"), Table{{"x", "a<b"}, Eigen::MatrixXd::Zero(2, 2)});
  const std::string text = content(path("a.vtu"));
  EXPECT_THAT(text, HasSubstr("NumberOfPoints=\"2\""));
  EXPECT_THAT(text, HasSubstr("Name=\"a&lt;b\""));
  EXPECT_THAT(text, testing::Not(HasSubstr("Name=\"x\"")));
}

TEST(Table, TheFirstColumnGivesTheLength) {
  Table table;
  table.add("x", Eigen::Vector2d(1, 2));
  table.add("y", Eigen::Vector2d(3, 4));
  EXPECT_EQ(table.values, (Eigen::Matrix2d() << 1, 3, 2, 4).finished());
  EXPECT_THROW(table.add("z", Eigen::Vector3d(1, 2, 3)), InvalidInput);
}

TEST(Table, ColumnsAreAddedAndRowsSelected) {
  Table table{{"x"}, Eigen::Vector3d(1, 2, 3)};
  table.add("T", Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(table.select({2, 0}).values, (Eigen::Matrix2d() << 3, 6, 1, 4).finished());
  EXPECT_THROW(table.add("T", Eigen::Vector3d(4, 5, 6)), InvalidInput);
  EXPECT_THROW(table.add("U", Eigen::Vector2d(4, 5)), InvalidInput);
}

}  // namespace
}  // namespace gradpsi
