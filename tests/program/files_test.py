"""The files that people have: faults 38 and 39. All cases are the same 25 points with T = x^2 + 3 y^2 - x y."""

import unittest

import numpy as np

from program import ROOT, ProgramTest

CASES = ROOT / "tests" / "cases"


class Files(ProgramTest):
    def derive(self, case, field="T", *more, expect=0, warning=None):
        return self.run_program("derive", CASES / case, "--field", field, "--scheme", "laplacian-mixed-soc-ls",
                                "--support-ratio", 3, *more, "-o", self.path("out.csv"), expect=expect, warning=warning)

    def lines(self):
        return self.path("out.csv").read_text().splitlines()

    def laplacian(self):
        lines = self.lines()
        self.assertEqual(len(lines), 26)
        return np.array([float(line.split(",")[-1]) for line in lines[1:]])

    def test_39_dialects_are_read(self):
        for case in ["csv_semicolon", "csv_tab", "csv_space", "csv_semicolon_decimal_comma", "csv_comments",
                     "csv_quoted_cells", "csv_exponent_D", "csv_index_column", "csv_text_column",
                     "csv_unused_empty_column", "csv_large_ids"]:
            self.derive(case + ".csv")
            np.testing.assert_allclose(self.laplacian(), 8, atol=1e-3, err_msg=case)

    def test_39_coordinates_under_other_names_are_recognised(self):
        self.derive("csv_upper_case.csv", warning="columns 'X', 'Y' are taken as x, y")
        np.testing.assert_allclose(self.laplacian(), 8, atol=1e-3)
        self.derive("csv_units_in_names.csv", "T [K]", warning="columns 'x [m]', 'y [m]' are taken as x, y")
        np.testing.assert_allclose(self.laplacian(), 8, atol=1e-3)
        self.assertTrue(self.lines()[0].endswith("lap_T [K]"))
        self.derive("csv_paraview.csv", "T", "--columns", "x=Points:0,y=Points:1,zero=Points:2")
        np.testing.assert_allclose(self.laplacian(), 8, atol=1e-3)

    def test_39_names_can_be_given(self):
        error = self.derive("points_no_header.xyz", expect=1)
        self.assertIn("points_no_header.xyz:1: expected a header row such as x,y,volume, found numbers", error)
        self.derive("points_no_header.xyz", "T", "--columns", "x,y,T")
        np.testing.assert_allclose(self.laplacian(), 8, atol=1e-3)
        self.assertIn("3 columns where the header has 2",
                      self.derive("points_no_header.xyz", "T", "--columns", "x,T", expect=1))
        self.assertIn("a header", self.derive("csv_tab.csv", "T", "--columns", "x,y,T", expect=1))
        self.derive("csv_tab.csv", "u", "--columns", "u=T")
        self.assertIn("unknown column 'Temp'", self.derive("csv_tab.csv", "T", "--columns", "T=Temp", expect=1))
        self.assertIn("--columns", self.derive("csv_tab.csv", "T", "--columns", "x,T=Temp", expect=2))

    def test_38_what_nobody_asked_for_comes_out_as_it_went_in(self):
        for case, name in [("csv_large_ids.csv", "id"), ("csv_text_column.csv", "material"),
                           ("csv_unused_empty_column.csv", "Type"), ("csv_index_column.csv", "index")]:
            self.derive(case)
            given = [[cell.strip() for cell in line.split(",")] for line in (CASES / case).read_text().splitlines()]
            k = given[0].index("" if name == "index" else name)
            got = [line.split(",") for line in self.lines()]
            self.assertEqual(got[0][k], name)
            self.assertEqual([row[k] for row in got[1:]], [row[k] for row in given[1:]], case)

    def test_38_a_cell_that_is_needed_is_named(self):
        self.assertRegex(self.derive("csv_missing_cell.csv", expect=1),
                         r"csv_missing_cell\.csv:\d+: column 'T': '' is not a number")
        self.assertIn("column 'material': 'steel' is not a number", self.derive("csv_text_column.csv", "material", expect=1))
        mixed = self.path("mixed.csv")
        mixed.write_text("x,y,T\n" + (CASES / "csv_semicolon.csv").read_text().split("\n", 1)[1])
        self.assertIn("1 columns where the header has 3; it looks parted by ';', the header by ','",
                      self.run_program("derive", mixed, "--field", "T", "--scheme", "laplacian-ls-2", "-o",
                                       self.path("out.csv"), expect=1))


if __name__ == "__main__":
    unittest.main()
