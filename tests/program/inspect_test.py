"""gradpsi inspect."""

import json
import os
import re
import subprocess
import unittest

import numpy as np
import scipy.io

from program import PROGRAM, ProgramTest


class Inspect(ProgramTest):
    def test_the_verdict_agrees_with_the_eigenvalues(self):
        points = self.square(14, edge=lambda x, y: np.minimum.reduce([x, y, 1 - x, 1 - y]) < 0.07)
        for scheme, extra, grows in [("laplacian-mixed-soc", ["--support", 0.21], True),
                                     ("laplacian-mixed-soc", ["--support", 0.21, "--fixed", "edge"], False),
                                     ("laplacian-positive", ["--fixed", "edge"], False)]:
            text = self.run_program("inspect", points, "--scheme", scheme, *extra, "--spectrum",
                                    "--report", self.path("r.json"), "-o", self.path("i.csv"))
            found = json.loads(self.path("r.json").read_text())["inspection"]
            self.assertEqual(found["verdict"]["grows"], grows)
            self.assertEqual(found["spectrum"]["grows"], grows)
            self.assertIn("not fit: fields grow" if grows else "fit up to dt nu", text)
            self.assertGreaterEqual(found["spectrum"]["euler_step"], found["verdict"]["euler_step"])
            t = self.read_csv("i.csv")
            self.assertEqual(t["amplification"].argmax(), found["amplification"]["point_of_max"])
            self.assertEqual(len(t["x"]), 196)
        self.run_program("inspect", points, "--scheme", "gradient-ls-3")

    def test_error_bounds_are_bounds_or_nan(self):
        """A cubic's error is its third derivatives times the bound at most; rows that promise less have none."""
        points = self.square(12, T=lambda x, y: x**3)
        for scheme, support, policy in [("laplacian-mixed-soc-ls", 0.25, "fail"), ("laplacian-mixed-soc-ls", 0.14, "lower"),
                                        ("laplacian-mixed-soc-ls", 0.12, "zero"), ("laplacian-mixed-zoc", 0.25, "fail"),
                                        ("laplacian-positive", 0.25, "zero")]:
            common = [points, "--scheme", scheme, "--support", support, "--on-degenerate", policy]
            text = self.run_program("inspect", *common, "-o", self.path("i.csv"), "--report", self.path("r.json"))
            rows = self.read_csv("i.csv")
            self.run_program("derive", *common, "--field", "T", "-o", self.path("d.csv"))
            error = np.abs(self.read_csv("d.csv")["lap_T"] - 6 * rows["x"])
            has_bound = rows["degree"] >= 2
            np.testing.assert_array_equal(np.isnan(rows["error_bound"]), ~has_bound)
            self.assertTrue((error <= 6 * rows["error_bound"] + 1e-11)[has_bound].all())
            spread = json.loads(self.path("r.json").read_text())["inspection"]["error_bound"]
            if has_bound.any():
                self.assertEqual(spread["max"], np.nanmax(rows["error_bound"]))
                self.assertEqual(f"; {np.sum(~has_bound)} row" in text, not has_bound.all())
            else:
                self.assertIsNone(spread["max"])

    def test_eigenvalues_are_those_of_the_written_matrix(self):
        points = self.square(10)
        common = [points, "--scheme", "laplacian-direct-zoc", "--support", 0.3]
        self.run_program("assemble", *common, "-o", self.path("m.mtx"))
        values = np.linalg.eigvals(scipy.io.mmread(self.path("m.mtx")).toarray())
        self.run_program("inspect", *common, "--spectrum", "--report", self.path("r.json"))
        found = json.loads(self.path("r.json").read_text())["inspection"]["spectrum"]
        np.testing.assert_allclose([found["rightmost"], found["leftmost"]],
                                   [values.real.max(), values.real.min()], rtol=1e-9)

    def test_no_more_threads_are_started_than_asked_for(self):
        # Above 2,000 rows the spectrum is iterated. OpenMP says of every team how many threads it has.
        points = self.square(46)
        environment = {**os.environ, "OMP_NUM_THREADS": "4", "OMP_DISPLAY_AFFINITY": "TRUE",
                       "OMP_AFFINITY_FORMAT": "a team of %N"}
        for threads in [1, 3]:
            done = subprocess.run(
                [PROGRAM, "inspect", points, "--scheme", "laplacian-mixed-zoc", "--support-ratio", "2.5", "--spectrum",
                 "--threads", str(threads)],
                env=environment, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            teams = [int(size) for size in re.findall(r"a team of (\d+)", done.stderr)]
            self.assertEqual(max(teams, default=1), threads)


if __name__ == "__main__":
    unittest.main()
