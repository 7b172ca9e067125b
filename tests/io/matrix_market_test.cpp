#include <sstream>
#include <system_error>

#include "io/files.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;
using Fault27 = Files;
using Write = Files;
using Market = Files;

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

}  // namespace
}  // namespace gradpsi
