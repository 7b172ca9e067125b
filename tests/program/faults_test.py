"""What the table of tests/README.md says."""

import ast
import json
import re
import subprocess
import unittest

import numpy as np
import scipy.io

from program import PROGRAM, ProgramTest, ROOT


class Faults(ProgramTest):
    """What the table in README.md says, where no other class does."""

    def warned(self, *arguments):
        """What a command that succeeds says on standard error; its report."""
        done = subprocess.run([PROGRAM, *map(str, arguments), "--report", self.path("r.json")],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stderr, json.loads(self.path("r.json").read_text())

    def commands(self, points):
        options = [points, "--scheme", "laplacian-mixed-zoc", "--support-ratio", 3]
        return [["assemble", *options, "-o", self.path("m.mtx")],
                ["derive", *options, "--field", "u", "-o", self.path("d.csv")],
                ["diffuse", *options, "--field", "u", "--time-step", 1e-3, "--steps", 1, "-o", self.path("t.csv")],
                ["inspect", *options]]

    def test_05_a_close_pair_is_warned_of_and_reported(self):
        x, y = np.meshgrid(np.arange(9.0), np.arange(9.0))
        x, y = x.ravel(), y.ravel()
        healthy = self.write_points({"x": x, "y": y, "u": x}, "healthy.csv")
        x[40], y[40] = x[13] + 1e-3, y[13]
        points = self.write_points({"x": x, "y": y, "u": x})
        for command in self.commands(points):
            text, report = self.warned(*command)
            self.assertEqual(len(report["warnings"]), 1)
            self.assertEqual(text, f"warning: {report['warnings'][0]}\n")
            self.assertIn("points 13 and 40 are 0.001 apart, where the nearest point is usually 1 away", text)
        for command in self.commands(healthy):
            text, report = self.warned(*command)
            self.assertEqual(text, "")
            self.assertNotIn("warnings", report)

    def test_09_a_far_origin_is_warned_of_once(self):
        self.square(20, u=lambda x, y: x)
        t = self.read_csv("points.csv")
        far = self.write_points({"x": t["x"] + 3e8, "y": t["y"], "u": t["u"]}, "far.csv")
        for command in self.commands(far):
            text, _ = self.warned(*command)
            self.assertRegex(text, r"^warning: coordinates reach 3e\+08 where points are 0.0\d+ apart: [^\n]*\n$")

    def test_44_rows_that_let_a_field_grow_are_named_at_once(self):
        def diffuse(side):
            points = self.square(side, u=lambda x, y: np.sin(5 * x))
            usual = [points, "--scheme", "laplacian-direct-soc", "--support-ratio", 3]
            self.run_program("assemble", *usual, "-o", self.path("m.mtx"))
            rows = np.flatnonzero(1 / 0.1 - scipy.io.mmread(self.path("m.mtx")).diagonal() <= 0)
            self.assertTrue(3 < len(rows) < side**2 / 2)
            named = (f"of {len(rows)} rows the diagonal entry has not the sign of most, as where a field grows: "
                     "point {}, point {}, point {}, ..".format(*rows))
            return named, ["diffuse", *usual, "--field", "u", "--time-step", 0.1, "--steps", 1,
                           "-o", self.path("t.csv"), "--method"]

        # Few rows: multigrid has a factor of them.
        _, command = diffuse(30)
        fields = []
        for method in ["lu", "krylov", "multigrid"]:
            said = self.run_program(*command, method)
            self.assertEqual("rows of weak diagonals corrected by themselves" in said, method != "lu")
            fields.append(self.read_csv("t.csv")["u"])
        for other in fields[1:]:
            np.testing.assert_allclose(other, fields[0], rtol=0, atol=1e-7 * np.abs(fields[0]).max())
        # Many rows: multigrid names them, the diagonal is tried with a warning.
        named, command = diffuse(60)
        said = self.run_program(*command, "multigrid", expect=1)
        self.assertRegex(said, r"multigrid: the diagonals of \d+ of 3600 rows are weak, .* those of point \d+, ")
        said = self.run_program(*command, "krylov", expect=1, warning=f"krylov may not converge: {named}")
        self.assertRegex(said, f"^error: step 1: BiCGSTAB .* iterations; try lu; {named}\n$")
        self.run_program(*command, "lu")

    def test_the_table_is_whole(self):
        here = ROOT / "tests"
        exist = {f"{suite}.{name}" for source in here.rglob("*_test.cpp")
                 for suite, name in re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", source.read_text(), re.M)}
        for source in here.rglob("*_test.py"):
            module = ast.parse(source.read_text())
            for name, body in [(source.stem, module.body), *((n.name, n.body) for n in module.body if isinstance(n, ast.ClassDef))]:
                exist |= {f"{name}.{f.name}" for f in body if isinstance(f, ast.FunctionDef)}
        named = {}
        for number, tests in re.findall(r"^\| (\d+) \|.*\|(.*)\|$", (here / "README.md").read_text(), re.M):
            named[int(number)] = set(re.findall(r"`(\w+\.\w+)`", tests))
        self.assertEqual(list(named), [*range(1, 48)])
        for number, tests in named.items():
            self.assertEqual(tests - exist, set(), "are in the table only")
            numbered = {t for t in exist if re.match(rf"Fault{number:02}(?!\d)|\w+\.test_{number:02}_", t)}
            self.assertTrue(numbered, f"nothing is named after {number}")
            self.assertEqual(numbered - tests, set(), f"are not in line {number}")


if __name__ == "__main__":
    unittest.main()
