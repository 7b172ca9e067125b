"""gradpsi inspect."""

import json
import os
import re
import subprocess
import unittest

import numpy as np
import scipy.io

from program import PROGRAM, ROOT, ProgramTest

CASES = ROOT / "tests" / "cases"


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

    def test_with_the_spectrum_the_verdict_is_that_of_the_spectrum(self):
        """On these points rows look worse than they are: what grows around some is held by the others."""
        def mirrored(k, base):
            digits = 0.0
            scale = 1.0 / base
            while k > 0:
                digits, k, scale = digits + k % base * scale, k // base, scale / base
            return digits
        points = self.write_points({axis: [mirrored(k, base) for k in range(1001, 1401)] for axis, base in [("x", 2), ("y", 3)]})
        common = ["inspect", points, "--scheme", "laplacian-ls-4", "--support-ratio", 4.5, "--periodic", "1,1",
                  "--on-degenerate", "widen", "--report", self.path("r.json")]
        verdicts = []
        for options in [[], ["--spectrum"]]:
            text = self.run_program(*common, *options)
            found = json.loads(self.path("r.json").read_text())["inspection"]
            grows = found["verdict"]["grows"]
            self.assertEqual(grows, "explicit steps        not fit: fields grow" in text)
            self.assertEqual(grows, "implicit steps        not fit" in text)
            self.assertEqual(not grows, "any dt" in text)
            verdicts.append(grows)
        self.assertEqual(verdicts, [True, False], "these points show no difference any more")
        self.assertEqual(found["spectrum"]["grows"], found["verdict"]["grows"])
        self.assertEqual(found["spectrum"]["euler_step"], found["verdict"]["euler_step"])
        self.assertIn("by all eigenvalues", text)

    def test_growth_by_the_spectrum_is_said_once(self):
        text = self.run_program("inspect", CASES / "ring_direct_zoc_grows.csv", "--scheme", "laplacian-direct-zoc", "--support",
                                0.13029049555684147, "--on-degenerate", "lower", "--kernel", "gaussian", "--fixed", "fixed",
                                "--spectrum", "--report", self.path("r.json"))
        found = json.loads(self.path("r.json").read_text())["inspection"]
        step = found["spectrum"]["singular_steps"][0]
        self.assertAlmostEqual(found["verdict"]["rate"] * step, 1)
        self.assertIn(f"singular at dt nu = {step:.6g} and 11 larger ones", text)
        self.assertNotIn("any dt", text)
        self.assertNotIn("neither", text)

    def test_walls_are_part_of_what_is_judged(self):
        """As `diffuse` steps it: fields grow with walls of one kind and not with the other."""
        bare = [CASES / "walls_on_an_l.csv", "--scheme", "laplacian-positive", "--support", 0.375, "--volume", 0.015625,
                "--on-degenerate", "widen", "--fixed", "fixed", "--normal", "n"]
        steps = ["--field", "T", "--source", "f", "--time-step", 0.0015625, "--steps", 300, "-o", self.path("o.csv")]
        for gradient, grows in [("positive", False), ("gradient-direct-foc", False), ("gradient-direct-soc", True)]:
            for spectrum in [["--spectrum"], []]:
                text = self.run_program("inspect", *bare, "--gradient", gradient, *spectrum, "--report", self.path("r.json"))
                found = json.loads(self.path("r.json").read_text())["inspection"]
                self.assertEqual(found["verdict"]["grows"], grows, text)
                walls = found["matrix"]["walls"]
                self.assertEqual(walls["points"], walls["second_order"] + walls["first_order"] + walls["by_gradient"])
                self.assertEqual(walls["by_gradient"] == walls["points"], gradient != "positive")
            self.run_program("diffuse", *bare, "--gradient", gradient, *steps, expect=1 if grows else 0)
        error = self.run_program("inspect", *bare, "--gradient", "laplacian-positive", expect=1)
        self.assertIn("laplacian-positive is not a gradient", error)

    def test_values_at_walls_follow_from_those_inside(self):
        """A line with a wall at each end, against the same by numpy."""
        n = 20
        x = (np.arange(n) + 0.5) / n
        normal = np.zeros(n)
        normal[[0, -1]] = -1, 1
        for transfer in [0, 7]:
            points = self.write_points({"x": x, "nx": normal, "c": transfer + 0 * x})
            common = [points, "--scheme", "laplacian-mixed-zoc", "--support", 1.5 / n, "--volume", 1 / n]
            self.run_program("inspect", *common, "--normal", "n", "--transfer", "c", "--gradient", "gradient-direct-foc",
                             "--spectrum", "--report", self.path("r.json"))
            found = json.loads(self.path("r.json").read_text())["inspection"]
            self.assertEqual(found["matrix"]["points"], n - 2)
            self.run_program("assemble", *common, "-o", self.path("m.mtx"))
            matrix = scipy.io.mmread(self.path("m.mtx")).toarray()[1:-1]
            part = 1 / (1 + transfer / n)  # of the value beside it: (wall - inner) n + transfer wall = 0
            matrix[:, 1] += part * matrix[:, 0]
            matrix[:, -2] += part * matrix[:, -1]
            values = np.linalg.eigvals(matrix[:, 1:-1])
            np.testing.assert_allclose([found["spectrum"]["rightmost"], found["spectrum"]["leftmost"]],
                                       [values.real.max(), values.real.min()], rtol=1e-9, atol=1e-6)

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
            teams = [int(size) for size in re.findall(r"a team of (\d+)", done.stderr + done.stdout)]
            self.assertEqual(max(teams, default=1), threads)


if __name__ == "__main__":
    unittest.main()
