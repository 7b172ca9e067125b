"""gradpsi advise."""

import json
import re
import unittest

import numpy as np
import scipy.io

from program import ProgramTest


class Advise(ProgramTest):
    def candidates(self, points, kind, dimension):
        names = [s["name"] for s in json.loads(self.run_program("schemes", "--json"))]
        return [(name, ratio) for name in names if name.startswith(kind) for ratio in [2, 2.5, 3, 3.5, 4.5]]

    def matrices(self, points, scheme, ratio):
        self.run_program("assemble", points, "--scheme", scheme, "--support-ratio", ratio, "--on-degenerate",
                         "widen", "--report", self.path("r.json"), "-o", self.path("m.mtx"))
        report = json.loads(self.path("r.json").read_text())
        files = ["m.mtx"] if scheme.startswith("laplacian") else ["m_x.mtx", "m_y.mtx"]
        return ([scipy.io.mmread(self.path(f)).tocsr() for f in files],
                report.get("degenerate", {}).get("zero", 0))

    def error(self, matrices, x, y, rows, length):
        """Of the waves, by the letter of the help text."""
        k = 2 * np.pi / length
        squares, exact = 0, 0
        for e in [(1, 0), (0, 1), (0.5**0.5, 0.5**0.5), (0.5**0.5, -0.5**0.5)]:
            for shift in [0, np.pi / 2]:
                phase = k * (e[0] * x + e[1] * y) + shift
                if len(matrices) == 1:
                    derivatives = [-k * k * np.sin(phase)]
                else:
                    derivatives = [k * e[0] * np.cos(phase), k * e[1] * np.cos(phase)]
                squares += sum(np.sum((m @ np.sin(phase) - d)[rows]**2) for m, d in zip(matrices, derivatives))
                exact += len(rows) * (k**4 if len(matrices) == 1 else k**2) / 2
        return (squares / exact)**0.5

    def test_implicit_steps_agree_with_brute_force_and_eigenvalues(self):
        points = self.square(13, edge=lambda x, y: np.minimum.reduce([x, y, 1 - x, 1 - y]) < 1 / 13)
        t = self.read_csv("points.csv")
        rows = np.flatnonzero(t["edge"] == 0)
        best = {0.2: (np.inf, None), 0.03: (np.inf, None)}  # of each tolerance
        for scheme, ratio in self.candidates(points, "laplacian", 2):
            (m,), _ = self.matrices(points, scheme, ratio)
            counts = np.diff(m.indptr)[rows]
            inner = m.toarray()[np.ix_(rows, rows)]
            error = self.error([m], t["x"], t["y"], rows, 0.8)
            if error > max(best) or (counts == 1).any():
                continue
            if np.linalg.eigvals(inner).real.max() > 1e-3 * np.median(-np.diag(inner)):
                continue
            for tolerance in best:
                if error <= tolerance:
                    best[tolerance] = min(best[tolerance], (counts.mean(), f"{scheme} with --support-ratio {ratio:g}"))
        for tolerance, (_, taken) in best.items():
            text = self.run_program("advise", points, "--operator", "laplacian", "--use", "implicit", "--fixed", "edge",
                                    "--tolerance", tolerance, "--wavelength", 0.8)
            self.assertIn(f"Take {taken}: ", text)
            self.assertIn("gradpsi diffuse", text)

    def test_a_derivative_meets_the_tolerance_and_its_command_runs(self):
        points = self.square(20, u=lambda x, y: np.sin(7 * x + 2 * y))
        t = self.read_csv("points.csv")
        for kind, tolerance in [("gradient", 0.02), ("laplacian", 0.1)]:
            text = self.run_program("advise", points, "--operator", kind, "--tolerance", tolerance, "--wavelength", 0.9,
                                    "--check")
            scheme, ratio = re.search(r"Take (\S+) with --support-ratio (\S+):", text).groups()
            matrices, _ = self.matrices(points, scheme, ratio)
            error = self.error(matrices, t["x"], t["y"], np.arange(400), 0.9)
            self.assertLessEqual(error, tolerance)
            self.assertIn(f"error {error:.2g} ", text)
            # Everything was looked at already: only the clock can make a difference.
            self.assertRegex(text, r"Brute force, \d+ candidates on all 400 rows: \S+ with")
            command = re.search(r"gradpsi (derive .*)", text).group(1).replace("OUT.vtu", str(self.path("d.csv")))
            self.run_program(*command.split())
            self.assertIn("u_x" if kind == "gradient" else "lap_u", self.read_csv("d.csv"))

    def test_it_says_what_does_best_and_which_spacing_would(self):
        points = self.square(10)
        text = self.run_program("advise", points, "--operator", "gradient", "--tolerance", 1e-9)
        self.assertIn("Nothing meets 1e-09. The best is gradient-ls-6", text)
        text = self.run_program("advise", points, "--operator", "gradient", "--tolerance", 1e-5, "--wavelength", 0.5)
        self.assertRegex(text, r"A spacing of about \S+ would \(now \S+\), with gradient-ls-6")

    def test_in_a_periodic_box_waves_fit_it(self):
        points = self.square(12)
        t = self.read_csv("points.csv")
        outside = self.write_points({"x": t["x"] + 3, "y": t["y"]}, "outside.csv")
        found = [self.run_program("advise", p, "--operator", "laplacian", "--tolerance", 0.1, "--periodic", "1,1",
                                  "--use", "implicit").split("Take")[1].split("(")[0] for p in [points, outside]]
        self.assertEqual(*found)

    def test_bad_requests(self):
        points = self.square(8)
        def advise(*more, expect=1):
            return self.run_program("advise", points, "--operator", "gradient", *more, expect=expect)
        self.assertIn("--tolerance must be > 0", advise("--tolerance", 0))
        self.assertIn("--tolerance must be > 0", advise("--tolerance", "nan"))
        self.assertIn("--wavelength must be > 0", advise("--tolerance", 0.1, "--wavelength", -1))
        self.assertIn("shorter than two spacings", advise("--tolerance", 0.1, "--wavelength", 0.01))
        self.assertIn("vanish or are beyond", advise("--tolerance", 0.1, "--wavelength", 1e200))
        self.assertIn("are about Laplacians", advise("--tolerance", 0.1, "--use", "implicit", expect=2))
        self.assertIn("Usage: gradpsi", advise(expect=2))
        one = self.write_points({"x": [0.5]}, "one.csv")
        self.assertIn("two points at least",
                      self.run_program("advise", one, "--operator", "gradient", "--tolerance", 1, expect=1))


if __name__ == "__main__":
    unittest.main()
