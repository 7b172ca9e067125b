"""gradpsi assemble."""

import csv
import json
import unittest

import numpy as np
import scipy.io
import scipy.optimize

from program import ProgramTest, ROOT


class Assemble(ProgramTest):
    def test_reference_matrices(self):
        for cloud, support in [("line", "0.10416666666666666"), ("square", "0.3571428571428571")]:
            points = ROOT / "tests" / "reference" / f"{cloud}.csv"
            n = sum(1 for _ in open(points)) - 1
            reference = {}
            with open(ROOT / "tests" / "reference" / f"{cloud}.triplets.csv") as file:
                for row in csv.DictReader(file):
                    matrix = reference.setdefault((row["scheme"], int(row["axis"])), np.zeros((n, n)))
                    matrix[int(row["row"]), int(row["col"])] = float(row["value"])
            for (scheme, axis), expected in reference.items():
                out = self.path("out.mtx")
                self.run_program("assemble", points, "--scheme", scheme, "--support", support, "-o", out)
                if scheme.startswith("gradient"):
                    out = self.path(f"out_{'xyz'[axis]}.mtx")
                matrix = scipy.io.mmread(out).toarray()
                largest = np.abs(expected).max(axis=1, keepdims=True)
                self.assertLess(np.max(np.abs(matrix - expected) / largest), 1e-8, scheme)

    def test_report(self):
        points = self.square(n=20, volume=lambda x, y: 0 * x + 1 / 400)
        self.run_program("assemble", points, "--scheme", "laplacian-mixed-soc", "--support-ratio", 2.6,
                         "--threads", 1, "--report", self.path("r.json"), "-o", self.path("l.mtx"))
        report = json.loads(self.path("r.json").read_text())
        self.assertEqual(list(report), ["points", "entries", "neighbours", "seconds", "degenerate_rows",
                                        "dropped_points", "peak_bytes", "threads"])
        self.assertEqual(list(report["neighbours"]), ["min", "median", "max"])
        self.assertEqual(list(report["seconds"]), ["read", "search", "weights", "write"])
        matrix = scipy.io.mmread(self.path("l.mtx")).tocsr()
        self.assertEqual(report["points"], 400)
        self.assertEqual(report["entries"], matrix.nnz)
        self.assertEqual(report["neighbours"]["max"], np.diff(matrix.indptr).max() - 1)
        self.assertEqual(report["neighbours"]["median"], np.median(np.diff(matrix.indptr)) - 1)
        self.assertEqual(report["degenerate_rows"], 0)
        self.assertEqual(report["threads"], 1)
        self.assertGreater(report["peak_bytes"], 1e6)

    def test_volume_and_support_options(self):
        points = self.square()
        bare = ["assemble", points, "--scheme", "laplacian-mixed-zoc"]
        self.run_program(*bare, "--support", 0.25, "--volume", 1 / 144, "-o", self.path("a.mtx"))
        self.run_program(*bare, "--support-ratio", 3, "--volume", 1 / 144, "-o", self.path("b.mtx"))
        self.assertEqual(self.path("a.mtx").read_text(), self.path("b.mtx").read_text())
        # Neither column nor option: number density. A column goes before the options.
        self.run_program(*bare, "--support", 0.25, "-o", self.path("c.mtx"))
        with_columns = self.square(volume=lambda x, y: 0 * x + 1 / 144, support=lambda x, y: 0 * x + 0.25)
        text = self.run_program("assemble", with_columns, "--scheme", "laplacian-mixed-zoc", "--volume",
                                9, "--support", 1, "-o", self.path("d.mtx"))
        self.assertIn("supports are those of the column 'support', not of the option\n", text)
        a, c, d = (scipy.io.mmread(self.path(f"{k}.mtx")).toarray() for k in "acd")
        np.testing.assert_array_equal(a, d)
        self.assertGreater(np.abs(a - c).max(), 0.01 * np.abs(a).max())

    def test_kernel_option(self):
        points = self.square()
        bare = ["assemble", points, "--scheme", "gradient-direct-foc", "--support", 0.25]
        self.run_program(*bare, "-o", self.path("a.mtx"))
        self.run_program(*bare, "--kernel", "wendland-c2", "-o", self.path("b.mtx"))
        self.run_program(*bare, "--kernel", "gaussian", "-o", self.path("c.mtx"))
        self.assertEqual(self.path("a_x.mtx").read_text(), self.path("b_x.mtx").read_text())
        self.assertNotEqual(self.path("a_x.mtx").read_text(), self.path("c_x.mtx").read_text())

    def test_periodic_box(self):
        points = self.square(u=lambda x, y: np.cos(2 * np.pi * y))
        self.run_program("assemble", points, "--scheme", "laplacian-mixed-soc", "--support", 0.3,
                         "--periodic", "0,1", "-o", self.path("l.mtx"))
        matrix = scipy.io.mmread(self.path("l.mtx")).tocsr()
        self.assertGreater(abs(matrix[0, 132]), 0)  # (0, 0) and (0, 11) of 12 x 12
        self.assertEqual(matrix[0, 11], 0)

    def test_duplicates(self):
        columns = {"x": [0.0, 0.1, 0.2, 0.1, 0.3, 0.4, 0.0], "T": [0, 1, 2, 3, 4, 5, 6]}
        points = self.write_points(columns)
        bare = ["assemble", points, "--scheme", "gradient-direct-zoc", "--support", 0.15]
        error = self.run_program(*bare, "-o", self.path("a.mtx"), expect=1)
        self.assertIn("points 1 and 3 coincide at (0.1); 2 of 7 points", error)
        self.assertFalse(self.path("a_x.mtx").exists())
        text = self.run_program(*bare, "--duplicates", "drop", "--report", self.path("r.json"),
                                "-o", self.path("a.mtx"), warning="2 dropped points differ from the one in their place "
                                "that is kept: 'T' by up to 6")
        self.assertIn("coincident points dropped: 2\n", text)
        self.assertEqual(scipy.io.mmread(self.path("a_x.mtx")).shape, (5, 5))
        self.assertEqual(json.loads(self.path("r.json").read_text())["dropped_points"], 2)
        self.run_program("derive", *bare[1:], "--field", "T", "--duplicates", "drop",
                         "-o", self.path("t.csv"), warning="2 dropped points")
        np.testing.assert_array_equal(self.read_csv("t.csv")["T"], [0, 1, 2, 4, 5])

    def test_degenerate_rows(self):
        points = self.write_points({"x": np.arange(12.0), "y": 2 * np.arange(12.0)})
        bare = ["assemble", points, "--scheme", "laplacian-mixed-soc", "--support", 7]
        error = self.run_program(*bare, "-o", self.path("a.mtx"), expect=1)
        self.assertIn("point 0: at least 5 neighbours are needed (3 neighbours, reciprocal", error)
        for policy, what in [("lower", "12 lowered in consistency, 0 widened, 0 zero; points 0 1 2 3 4 5 6 7 8 9 ...\n"),
                             ("widen", "0 lowered in consistency, 0 widened, 12 zero; points 0 1 2"),
                             ("zero", "0 lowered in consistency, 0 widened, 12 zero; points 0 1 2")]:
            text = self.run_program(*bare, "--on-degenerate", policy, "--report", self.path("r.json"),
                                    "-o", self.path("a.mtx"))
            self.assertIn("degenerate rows: 12, of them " + what, text)
            report = json.loads(self.path("r.json").read_text())
            self.assertEqual(report["degenerate_rows"], 12)
            self.assertEqual([row["point"] for row in report["degenerate"]["rows"]], list(range(12)))

    def test_a_scheme_with_a_support_of_its_own(self):
        points = self.square(15, u=lambda x, y: x**4 - 3 * x * y**3)
        self.run_program("derive", points, "--field", "u", "--scheme", "laplacian-ls-4", "-o", self.path("l.csv"))
        t = self.read_csv("l.csv")
        np.testing.assert_allclose(t["lap_u"], 12 * t["x"]**2 - 18 * t["x"] * t["y"], atol=1e-9)
        # Given too little support, rows fail unless told otherwise.
        few = ["derive", points, "--field", "u", "--scheme", "laplacian-ls-4", "--support-ratio", 2.6,
               "-o", self.path("l.csv")]
        self.assertIn("laplacian-ls-4 cannot be computed at point", self.run_program(*few, expect=1))
        self.run_program(*few, "--on-degenerate", "widen", "--report", self.path("r.json"))
        t = self.read_csv("l.csv")
        np.testing.assert_allclose(t["lap_u"], 12 * t["x"]**2 - 18 * t["x"] * t["y"], atol=1e-6)
        report = json.loads(self.path("r.json").read_text())
        self.assertEqual(report["degenerate"]["widened"], report["degenerate_rows"])
        self.assertEqual({row["degree"] for row in report["degenerate"]["rows"]}, {4})

    def test_positive_stencils_cost_what_a_linear_programme_says(self):
        points = self.square(12)
        self.run_program("assemble", points, "--scheme", "laplacian-positive", "--support", 0.26,
                         "--on-degenerate", "zero", "-o", self.path("p.mtx"))
        A = scipy.io.mmread(self.path("p.mtx")).tocsr()
        t = self.read_csv("points.csv")
        x = np.stack([t["x"], t["y"]], 1)
        with_stencil = 0
        for i in range(len(x)):
            r = (np.delete(x, i, 0) - x[i]) / 0.26
            r = r[np.hypot(*r.T) < 1]
            q = np.hypot(*r.T)
            rows = np.stack([*r.T, r[:, 0]**2, r[:, 0] * r[:, 1], r[:, 1]**2]) / q**2
            best = scipy.optimize.linprog(q**3, A_eq=rows, b_eq=[0, 0, 2, 0, 2], method="highs")
            row = A[i]
            if best.status != 0:
                self.assertEqual(row.nnz, 1)
                continue
            with_stencil += 1
            other = row.indices != i
            distance = np.hypot(*(x[row.indices[other]] - x[i]).T) / 0.26
            np.testing.assert_allclose((distance**5) @ row.data[other] * 0.26**2, best.fun, rtol=1e-8)
        self.assertGreaterEqual(with_stencil, 100)

    def test_no_points(self):
        self.path("none.csv").write_text("x,y\n")
        for support in ["--support", "--support-ratio"]:
            self.run_program("assemble", self.path("none.csv"), "--scheme", "gradient-direct-soc",
                             support, 2, "-o", self.path("g.mtx"))
            for axis in "xy":
                self.assertEqual(self.path(f"g_{axis}.mtx").read_text().split("\n")[1], "0 0 0")


if __name__ == "__main__":
    unittest.main()
