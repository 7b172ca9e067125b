#include <cmath>
#include <filesystem>
#include <limits>
#include <system_error>

#include "io/files.hpp"

namespace gradpsi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using Csv = Files;
using Fault27 = Files;
using Write = Files;

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
  EXPECT_THAT(content(path("t.csv")), HasSubstr(",a b\n"));
}

TEST_F(Csv, WhatPartsCellsIsFoundOut) {
  const Positions expected = (Positions(2, 2) << 0.5, -2, 30, 4).finished();
  for (const char* text :
       {"x;y\n0.5;-2\n3e1;4\n", "x;y\n0,5;-2\n3e1;4\n", "x\ty\n0.5\t-2\n3e1\t4\n",
        "x\ty\n0,5\t-2\n3e1\t4\n", "x y\n0.5 -2\n3e1 4\n", "  x   y\n 0,5 \t -2\n3D1  4 \n",
        "x,y\n0.5D0,-2\n3d+01,4\n", "\"x\",\"y\"\n\"0.5\",\"-2\"\n30,4\n",
        "// made by hand\n# x,y\n0.5,-2\n# between\n30,4\n",
        "# two\n# remarks\nx,y\n0.5,-2\n30,4\n", "# x y\n0.5 -2\n30 4\n",
        "x,y\n[m],[m]\n0.5,-2\n30,4\n", "x,y,\n0.5,-2,\n30,4,\n",
        "\"x [m]; east\";x;y\n1;0.5;-2\n1;30;4\n"})
    EXPECT_EQ(read_cloud(file(text)).positions(), expected) << text;
  // Once a file has a decimal point, a comma is none; in text beside numbers neither matters.
  EXPECT_THAT(error("x;y\n0.5;1,234\n"), HasSubstr("column 'y': '1,234' is not a number"));
  EXPECT_THAT(error("x;y\n0,5;1.5\n"), HasSubstr("column 'y': '1.5' is not a number"));
  EXPECT_THAT(error("x;y\n1,234.5;1\n"), HasSubstr("column 'x': '1,234.5' is not a number"));
}

TEST_F(Csv, NamesAreGivenWhereThereIsNoHeader) {
  const Table table = read_csv(file("1 2 3\n4 5 6\n"), 0, 1, {"x", "y", "T"});
  EXPECT_EQ(table.column("T"), Eigen::Vector2d(3, 6));
  EXPECT_EQ(read_csv(file("# x, y\n1 2\n"), 0, 1, {"a", "b"}).names[0], "a");
  EXPECT_THAT(message_of<InvalidInput>([&] {
                read_csv(file("x,y\n1,2\n"), 0, 1, {"a", "b"});
              }),
              HasSubstr(":1: names are given, but the file has a header"));
}

TEST_F(Csv, ColumnsThatAreNoNumbersAreKeptAsTheyAre) {
  const std::string text =
      "id,x,what,T\n9007199254740993,1,2,3\n1152921504606846977,2,\"a, b\",\n7,3,,nan\n";
  const Table table = read_csv(file(text));
  EXPECT_EQ(table.column("x"), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(table.column("id")[2], 7);  // rounded, but numbers
  EXPECT_THAT(table.text("id")->cells, ElementsAre("9007199254740993", "1152921504606846977", "7"));
  EXPECT_EQ(table.text("x"), nullptr);
  EXPECT_THAT(message_of<InvalidInput>([&] { table.column("what"); }),
              HasSubstr(":3: column 'what': 'a, b' is not a number"));
  EXPECT_THAT(message_of<InvalidInput>([&] { table.column("T"); }),
              HasSubstr(":3: column 'T': '' is not a number"));
  write_csv(path("out.csv"), table);
  EXPECT_EQ(content(path("out.csv")), text);
  EXPECT_THAT(table.select({2, 1}).text("what")->cells, ElementsAre("", "a, b"));
  Table set = table;
  set.set("T", Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(set.column("T")[1], 2);
  write_vtu(path("out.vtu"), table);  // numbers only
  EXPECT_THAT(content(path("out.vtu")), Not(HasSubstr("what")));
}

// Found by a fuzzer.
TEST_F(Csv, WhatIsWrittenIsReadAgain) {
  for (const char* text : {"2,y,;z0,y#x\"x,\"#)\t\t,.5\n", "2,\n2,\n ,\n", "#1,2\n3,4\n",
                           "a;b,\n0,5;e-3\n,;1\n", "x\na\nb\n1\n"}) {
    const Table table = read_csv(file(text));
    write_csv(path("t.csv"), table);
    const Table back = read_csv(path("t.csv"));
    EXPECT_EQ(back.names, table.names) << text;
    EXPECT_EQ(back.values.unaryExpr([](double x) { return std::isnan(x) ? -77 : x; }),
              table.values.unaryExpr([](double x) { return std::isnan(x) ? -77 : x; }));
    ASSERT_EQ(back.texts.size(), table.texts.size()) << text;
    for (std::size_t k = 0; k < table.texts.size(); ++k)
      EXPECT_EQ(back.texts[k].cells, table.texts[k].cells) << text;
  }
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
          read_csv(file(broken), part, parts).column("x");
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
  // A decimal comma makes a column more.
  EXPECT_THAT(error("x,y\n1,5,2,5\n"), HasSubstr(":2: 4 columns"));
  EXPECT_THAT(error("x,y\n1;2\n"),
              HasSubstr(":2: 1 columns where the header has 2; it looks parted by ';'"));
  EXPECT_THAT(error("1,2\n3,4\n"),
              HasSubstr(":1: expected a header row such as x,y,volume, found numbers"));
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
