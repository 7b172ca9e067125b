"""Rows chosen to a tolerance: --tolerance in place of a scheme and a support."""

import json
import re
import unittest

import numpy as np
import scipy.io

from program import ProgramTest


class Tolerance(ProgramTest):
    def scene(self, n=24):
        return self.square(n, T=lambda x, y: np.sin(2 * np.pi * x) * y, vx=lambda x, y: -y, vy=lambda x, y: x,
                           wall=lambda x, y: (np.minimum(x, y) < 1 / n) | (np.maximum(x, y) > 1 - 1 / n))

    def test_a_derivative_without_scheme_and_support(self):
        points = self.scene()
        text = self.run_program("derive", points, "--field", "T", "--what", "laplacian", "--tolerance", 0.02,
                                "--report", self.path("r.json"), "-o", self.path("lap.csv"))
        self.assertIn("laplacian good to 0.02 for waves of length 0.9", text)
        report = json.loads(self.path("r.json").read_text())
        self.assertEqual(sum(report["schemes"].values()), 576)
        self.assertGreater(len(report["schemes"]), 1)
        self.assertTrue(0 < report["largest_error"] <= 0.02)
        lap = self.read_csv("lap.csv")
        exact = -(2 * np.pi) ** 2 * lap["T"]
        self.assertLess(np.abs(lap["lap_T"] - exact).max(), 2 * 0.02 * (2 * np.pi) ** 2)
        text = self.run_program("derive", points, "--field", "vx,vy", "--what", "curl", "--tolerance", 0.02,
                                "-o", self.path("curl.csv"))
        self.assertRegex(text, r"rows by .*ls-\d \d+.*; largest error 0\.01\d+\n")
        np.testing.assert_allclose(self.read_csv("curl.csv")["curl_v"], 2, atol=1e-9)

    def test_a_matrix_has_fewer_entries_than_one_scheme_as_good(self):
        points = self.scene()
        asked = ["assemble", points, "--what", "laplacian", "--tolerance", 0.03, "--wavelength", 0.7, "-o"]
        self.run_program(*asked, self.path("chosen.mtx"))
        chosen = scipy.io.mmread(self.path("chosen.mtx")).tocsr()
        self.run_program("assemble", points, "--scheme", "laplacian-ls-4", "-o", self.path("one.mtx"))
        self.assertLess(chosen.nnz, 0.5 * scipy.io.mmread(self.path("one.mtx")).nnz)
        np.testing.assert_allclose(chosen @ np.ones(576), 0, atol=1e-8)

    def test_a_column_of_wavelengths(self):
        points = self.square(20, T=lambda x, y: x, L=lambda x, y: np.where(x < 0.5, 0.8, 3))
        text = self.run_program("assemble", points, "--what", "laplacian", "--tolerance", 0.1, "--wavelength", "L",
                                "-o", self.path("m.mtx"))
        self.assertIn("laplacian good to 0.1 for waves of length L: 400 points", text)
        entries = np.diff(scipy.io.mmread(self.path("m.mtx")).tocsr().indptr)
        x = self.read_csv("points.csv")["x"]
        self.assertGreater(entries[x < 0.5].mean(), 1.3 * entries[x > 0.5].mean())
        self.assertIn("unknown column 'M'", self.run_program(
            "assemble", points, "--what", "laplacian", "--tolerance", 0.1, "--wavelength", "M", "-o", self.path("m.mtx"), expect=1))

    # Ten spacings of 1/20 and a hundred of 1/400: the points nearest to the last wide one are all on one side.
    def test_both_sides_of_a_jump_of_spacings_are_seen(self):
        x = np.concatenate([np.arange(10) / 20, 0.5 + np.arange(101) / 400])
        points = self.write_points({"x": x, "T": x, "wall": (x < 0.06) | (x > 0.746), "support": 0 * x + 0.1})
        done = ["diffuse", points, "--field", "T", "--fixed", "wall", "--tolerance", 0.1, "--wavelength", 1, "--steady",
                "-o", self.path("T.csv")]
        self.run_program(*done, warning="the column 'support' is not used")
        np.testing.assert_allclose(self.read_csv("T.csv")["T"], x, atol=1e-10)

    def test_steps_keep_within_the_range(self):
        text = self.run_program("diffuse", self.scene(), "--field", "T", "--fixed", "wall", "--tolerance", 0.05,
                                "--wavelength", 0.5, "--time-step", 0.01, "--steps", 20, "-o", self.path("T.csv"))
        before, after = re.findall(r"in \[(\S+), (\S+?)\]", text)[-2:]
        self.assertGreaterEqual(float(after[0]), float(before[0]) - 0.01)
        self.assertLessEqual(float(after[1]), float(before[1]) + 0.01)

    def test_what_is_missed_is_an_error_with_a_way_out(self):
        points = self.scene()
        bare = ["derive", points, "--field", "T", "--what", "laplacian", "--wavelength", 0.15, "-o", self.path("o.csv")]
        error = self.run_program(*bare, "--tolerance", 0.001, expect=1)
        self.assertRegex(error, r"no row is good to 0\.001 at point \d+: the best one has an error of")
        self.assertFalse(self.path("o.csv").exists())
        met = re.search(r"all rows meet a tolerance of (\S+)", error)[1]
        self.run_program(*bare, "--tolerance", met)
        text = self.run_program(*bare, "--tolerance", 0.001, "--on-degenerate", "lower")
        self.assertRegex(text, r"rows that miss the tolerance: \d+, of them \d+ the best there are, 0 widened, 0 zero")
        self.run_program(*bare, "--tolerance", 0.001, "--on-degenerate", "zero")
        self.assertTrue((self.read_csv("o.csv")["lap_T"] == 0).any())  # as asked for

    def test_inspect_shows_the_schemes(self):
        text = self.run_program("inspect", self.scene(), "--what", "laplacian", "--tolerance", 0.05, "--fixed", "wall",
                                "-o", self.path("rows.csv"))
        self.assertIn("laplacian to a tolerance: 576 points", text)
        self.assertRegex(text, r"\n  schemes +\S+ \d+")
        self.assertLessEqual(self.read_csv("rows.csv")["certified_error"].max(), 0.05)

    def test_bad_requests(self):
        points = self.scene(8)
        derive = ["derive", points, "--field", "T", "-o", self.path("o.csv")]
        for more, words in [([], "--scheme: is required, or --tolerance"),
                            (["--tolerance", 0.1], "--what: --tolerance needs it: gradient, laplacian, divergence"),
                            (["--tolerance", 0.1, "--scheme", "laplacian-ls-2"], "--scheme excludes --tolerance"),
                            (["--tolerance", 0.1, "--support", 0.3], "excludes --tolerance"),
                            (["--wavelength", 0.1], "--wavelength requires --tolerance"),
                            (["--tolerance", 0.1, "--what", "laplacian", "--rows", "wall"], "--rows: is for a scheme"),
                            (["--tolerance", 0.1, "--what", "laplacian", "--neighbours", 9], "--neighbours: is for a scheme"),
                            (["--tolerance", 0.1, "--what", "laplacian", "--on-degenerate", "widen"], "fail, are lowered or zero")]:
            self.assertIn(words, self.run_program(*derive, *more, expect=2))
        self.assertIn("--what: --tolerance needs it",
                      self.run_program("assemble", points, "--tolerance", 0.1, "-o", self.path("o.mtx"), expect=2))
        self.assertIn("laplacian-ls-2 is a laplacian, not a gradient",
                      self.run_program("assemble", points, "--scheme", "laplacian-ls-2", "--what", "gradient",
                                       "-o", self.path("o.mtx"), expect=2))
        laplacian = [*derive, "--what", "laplacian"]
        self.assertIn("value takes a scheme, not a tolerance",
                      self.run_program(*derive, "--what", "value", "--tolerance", 1, expect=2))
        self.assertIn("tolerance must be > 0 and finite, not -1", self.run_program(*laplacian, "--tolerance", -1, expect=1))
        self.assertIn("wavelengths must be > 0", self.run_program(*laplacian, "--tolerance", 1, "--wavelength", 0, expect=1))


if __name__ == "__main__":
    unittest.main()
