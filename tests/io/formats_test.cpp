#include "io/files.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;
using Formats = Files;

TEST_F(Formats, WhatIsWrittenIsReadAgain) {
  const Table table{{"x", "T"}, Eigen::MatrixXd{{0.1, 1}, {0.2, 2}, {0.7, -3}}};
  for (const TableFormat& format : table_formats()) {
    const auto file = path("a" + std::string(format.ending));
    write_table(file, table);
    if (!format.read) continue;
    const Table whole = read_table(file), first = read_table(file, 0, 2),
                second = read_table(file, 1, 2);
    EXPECT_EQ(whole.names, table.names);
    EXPECT_EQ(whole.values, table.values) << format.ending;
    EXPECT_EQ(first.values.rows() + second.values.rows(), 3);
  }
  EXPECT_THAT(content(path("a.vtu")), HasSubstr("<VTKFile"));
}

TEST_F(Formats, AnEndingThatTellsNoneIsCsvToReadAndRefusedToWrite) {
  write_text(path("points.txt"), "x,T\n1,2\n");
  EXPECT_EQ(read_table(path("points.txt")).values(0, 1), 2);
  try {
    write_table(path("a.vtk"), Table{{"x"}, Eigen::MatrixXd::Zero(1, 1)});
    FAIL() << "written";
  } catch (const InvalidInput& error) {
    EXPECT_STREQ(error.what(), "unknown ending '.vtk'; valid: .vtu, .csv");
  }
}

}  // namespace
}  // namespace gradpsi
