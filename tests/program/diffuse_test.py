"""gradpsi diffuse."""

import json
import os
import re
import unittest
import xml.etree.ElementTree

import meshio
import numpy as np
import scipy.io
import scipy.sparse
import scipy.sparse.linalg

from program import ROOT, DiffusionScene


class Diffuse(DiffusionScene):
    def matrices(self, scheme, *files):
        self.run_program("assemble", self.points, "--scheme", scheme, "--support", 0.15, "-o", self.path("m.mtx"))
        return [scipy.io.mmread(self.path(file)).tocsr() for file in files]

    def diffuse(self, scheme, *arguments, expect=0):
        return self.run_program("diffuse", self.points, "--field", "T", "--scheme", scheme, "--support", 0.15,
                                "--report", self.path("r.json"), "-o", self.path("o.csv"), *arguments,
                                expect=expect)

    def test_positive_stencils_are_needed_only_where_no_condition_holds(self):
        edge = lambda x, y: np.minimum.reduce([x, y, 1 - x, 1 - y]) < 0.06
        points = self.square(20, T=lambda x, y: edge(x, y) * (x * x - y * y), edge=edge,
                             half=lambda x, y: edge(x, y) * (x < 0.5))
        steady = ["diffuse", points, "--field", "T", "--scheme", "laplacian-positive", "--support", 0.15,
                  "--steady", "-o", self.path("o.csv"), "--fixed"]
        self.run_program(*steady, "edge")
        t = self.read_csv("o.csv")
        np.testing.assert_allclose(t["T"], t["x"]**2 - t["y"]**2, atol=1e-12)  # harmonic, quadratic
        self.assertIn("none of its stencils is positive", self.run_program(*steady, "half", expect=1))

    def test_it_equals_an_independent_solve(self):
        t, n, nu, dt = self.table, 400, 0.3, 2e-5  # longer ones grow with the corrected schemes, for the edges are cut off
        diagonal = scipy.sparse.diags
        fixed, wall = t["wall"] != 0, t["nx"] != 0
        inner = ~fixed & ~wall
        normal = self.matrices("gradient-direct-soc", "m_x.mtx")[0]
        for scheme, method in [("laplacian-mixed-zoc", "auto"), ("laplacian-mixed-soc", "auto"),
                               ("laplacian-diffuse-soc", "krylov"), ("laplacian-direct-zoc", "lu")]:
            off = self.matrices(scheme, "m.mtx")[0].tocoo()
            mean = 2 / (1 / t["kappa"][off.row] + 1 / t["kappa"][off.col]) * (off.row != off.col)
            psi = scipy.sparse.csr_matrix((off.data * mean, (off.row, off.col)))
            psi = psi - diagonal(np.asarray(psi.sum(1)).ravel())
            for theta in [1, 0.5]:
                A = (diagonal(inner * 1.0) @ (scipy.sparse.identity(n) - dt * theta * nu * psi)
                     + diagonal(fixed * 1.0) + diagonal(wall * 1.0) @ normal)
                u = t["T"]
                for _ in range(3):
                    b = u + dt * (1 - theta) * nu * (psi @ u) + dt * t["f"]
                    u = scipy.sparse.linalg.spsolve(A.tocsc(), np.where(inner, b, np.where(fixed, u, t["flux"])))
                self.diffuse(scheme, "--diffusivity", nu, "--time-step", dt, "--steps", 3, "--theta", theta,
                             "--fixed", "wall", "--normal", "n", "--flux", "flux", "--source", "f",
                             "--conductivity", "kappa", "--mean", "harmonic", "--method", method,
                             "--gradient", "gradient-direct-soc")
                out = self.read_csv("o.csv")
                np.testing.assert_allclose(out["T"], u, rtol=0, atol=(1e-8 if method == "krylov" else 1e-9) * np.abs(u).max())
                self.assertEqual(list(out), list(t))
                for name in set(t) - {"T"}:
                    np.testing.assert_array_equal(out[name], t[name])

    def test_the_steady_problem(self):
        psi = self.matrices("laplacian-mixed-zoc", "m.mtx")[0]
        t, known = self.table, self.table["wall"] != 0
        u = t["T"].copy()
        u[~known] = scipy.sparse.linalg.spsolve(
            psi[~known][:, ~known].tocsc(), -t["f"][~known] / 2 - psi[~known][:, known] @ u[known])
        text = self.diffuse("laplacian-mixed-zoc", "--steady", "--diffusivity", 2, "--fixed", "wall",
                            "--source", "f")
        np.testing.assert_allclose(self.read_csv("o.csv")["T"], u, atol=1e-9 * np.abs(u).max())
        self.assertIn("solved by Cholesky", text)
        self.assertIn("the matrix is symmetric and positive definite", text)
        report = json.loads(self.path("r.json").read_text())
        self.assertEqual(report["points"], 400)
        self.assertEqual(report["solver"]["method"], "cholesky")
        self.assertEqual(report["solver"]["unknowns"], int((~known).sum()))
        self.assertGreater(report["solver"]["factor_entries"], 400)
        self.assertLess(report["steps"]["largest_residual"], 1e-12)
        self.assertEqual(self.path("o.png").read_bytes()[1:4], b"PNG")

    def test_exchange_at_walls(self):
        """A slab between T = 0 at x = 0 and exchange with 10 at x = 1: T = 10 c x / (1 + c), whatever the rows at walls."""
        side, c = np.linspace(0, 1, 15), 3.0
        x, y = (a.ravel() for a in np.meshgrid(side, side))
        wall = (x == 1) * 1.0
        points = self.write_points({"x": x, "y": y, "T": 0 * x, "held": (x == 0) * 1.0, "nx": wall - (x == 0), "ny": (x < 1) * (x > 0) * (
            (y == 1) * 1.0 - (y == 0)), "c": c * wall, "g": 10 * c * wall})
        bare = ["diffuse", points, "--field", "T", "--scheme", "laplacian-mixed-soc-ls", "--support", 0.2, "--fixed", "held",
                "--normal", "n", "--flux", "g", "--transfer", "c", "-o", self.path("o.csv"), "--on-degenerate", "widen"]
        exact = 10 * c * x / (1 + c)
        for rows in ["positive", "gradient-direct-foc"]:
            self.run_program(*bare, "--steady", "--gradient", rows)
            np.testing.assert_allclose(self.read_csv("o.csv")["T"], exact, atol=1e-9)
        steps = ["--time-step", 0.1, "--steps", 200]
        self.run_program(*bare, *steps)
        np.testing.assert_allclose(self.read_csv("o.csv")["T"], exact, atol=1e-4)
        warm = self.write_points({**self.read_csv("points.csv"), "T": 300 + x, "g": 0 * x})
        text = self.run_program("diffuse", warm, *bare[2:8], *bare[10:12], "--transfer", "c", *bare[16:], *steps)
        self.assertNotIn("never leaves", text)  # it cools down to what is around it
        self.assertLess(np.abs(self.read_csv("o.csv")["T"]).max(), 1e-3)

    def test_growth_is_an_error_with_a_way_out_that_works(self):
        """With sources or walls or without; steps of both methods, and the steady field."""
        cut = self.square(20, T=lambda x, y: (x < 0.5) * 1.0, held=lambda x, y: (x < 0.05) * 1.0, f=lambda x, y: 0 * x + 1)
        wall = ROOT / "tests" / "cases" / "walls_on_an_l.csv"
        on_the_l = ["--support", 0.375, "--volume", 0.015625, "--on-degenerate", "widen", "--fixed", "fixed", "--normal", "n",
                    "--gradient", "gradient-direct-soc", "--time-step", 0.0015625, "--steps", 300]
        on_the_square = ["--support", 0.15, "--fixed", "held", "--time-step", 0.01, "--steps", 200]
        for points, scheme, more in [(cut, "laplacian-mixed-soc", on_the_square),
                                     (cut, "laplacian-mixed-soc", [*on_the_square, "--source", "f"]),
                                     (cut, "laplacian-direct-soc", [*on_the_square, "--theta", 0.5]),
                                     (wall, "laplacian-positive", on_the_l),
                                     (wall, "laplacian-positive", [*on_the_l, "--source", "f"])]:
            bare = ["diffuse", points, "--field", "T", "--scheme", scheme, *more, "-o", self.path("o.csv")]
            error = self.run_program(*bare, expect=1)
            self.assertRegex(error, r"^error: step \d+: T is -?[\d.e+]+ at point \d+, and was within \[")
            self.assertFalse(self.path("o.csv").exists())
            way = re.search(r"; with (--.*) it does not \(tried\)", error)[1].split()
            for name, value in zip(way[::2], way[1::2]):
                bare = [*bare[:bare.index(name)], *bare[bare.index(name) + 2:]] if name in bare else bare
                bare += [name, value]
            self.run_program(*bare)
            self.path("o.csv").unlink()

    def test_sources_and_walls_may_move_a_field_as_far_as_they_do(self):
        """From nothing to thousands, or on and on, and no error: sources at work, a flux, conductivities."""
        for more in [["--fixed", "wall", "--source", "f", "--time-step", 1, "--steps", 50, "--diffusivity", 1e-4],
                     ["--source", "f", "--time-step", 10, "--steps", 200, "--diffusivity", 1e-4],
                     ["--normal", "n", "--flux", "flux", "--time-step", 1e-2, "--steps", 100],
                     ["--normal", "n", "--flux", "flux", "--fixed", "wall", "--steady"],
                     ["--fixed", "wall", "--source", "f", "--conductivity", "kappa", "--diffusivity", 1e-5, "--steady"]]:
            table = {**self.table, "T": 0 * self.table["T"]}
            points = self.write_points(table, "cold.csv")
            self.run_program("diffuse", points, "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", 0.15, *more,
                             "-o", self.path("o.csv"))
            self.assertGreater(np.abs(self.read_csv("o.csv")["T"]).max(), 0.1)

    def test_a_series_that_paraview_plays(self):
        self.diffuse("laplacian-mixed-zoc", "--time-step", 0.1, "--steps", 10, "--every", 4)
        pvd = xml.etree.ElementTree.parse(self.path("o.pvd"))
        sets = [(float(d.get("timestep")), d.get("file")) for d in pvd.iter("DataSet")]
        self.assertEqual(sets, [(0, "o_00.vtu"), (0.4, "o_04.vtu"), (0.8, "o_08.vtu"), (1, "o_10.vtu")])
        fields = [meshio.read(self.path(file)).point_data["T"] for _, file in sets]
        np.testing.assert_array_equal(fields[0], self.table["T"])
        np.testing.assert_array_equal(fields[-1], self.read_csv("o.csv")["T"])
        self.assertTrue(np.ptp(fields[0]) > np.ptp(fields[1]) > np.ptp(fields[2]) > np.ptp(fields[3]))

    def test_a_picture_in_every_dimension(self):
        grids = np.meshgrid(*[np.arange(6.0)] * 3)
        for dimension in [1, 2, 3]:
            columns = {axis: grids[k].ravel() for k, axis in enumerate("xyz"[:dimension])}
            points = self.write_points({**columns, "T'": columns["x"] * 0 + 7})
            self.run_program("diffuse", points, "--field", "T'", "--scheme", "laplacian-mixed-zoc", "--support",
                             1.5, "--duplicates", "drop", "--time-step", 1, "--steps", 1, "-o", self.path("a.vtu"))
            self.assertGreater(self.path("a.png").stat().st_size, 3000)
            self.path("a.png").unlink()

    def test_bad_usage_is_2(self):
        step = ["--time-step", 1, "--steps", 1]
        for arguments in [[], ["--steps", 1], ["--time-step", 1], [*step, "--theta", 0.7], [*step, "--damped-start"], [*step, "--flux", "f"],
                          ["--time-step", 1, "--steps", 0], [*step, "--fixed", ""], [*step, "--mean", "harmonic"],
                          [*step, "--conductivity", "f", "--mean", "geometric"], ["--steady", "--every", 2]]:
            self.assertIn("Usage: gradpsi diffuse", self.diffuse("laplacian-mixed-zoc", *arguments, expect=2))
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv"])

    def test_bad_data_is_1_and_leaves_nothing(self):
        def error(*arguments, scheme="laplacian-mixed-zoc", step=("--time-step", 1, "--steps", 1)):
            return self.diffuse(scheme, *step, *arguments, expect=1)
        self.assertIn("is not a Laplacian", error(scheme="gradient-direct-foc"))
        self.assertIn("column 'x' describes the points",
                      self.run_program("diffuse", self.points, "--field", "x", "--scheme", "laplacian-mixed-zoc",
                                       "--support", 1, "--time-step", 1, "--steps", 1, "-o", self.path("o.csv"),
                                       expect=1))
        self.assertIn("unknown column 'walls'; valid: wall, ", error("--fixed", "walls"))
        self.assertIn("unknown column 'mx'", error("--normal", "m"))
        self.assertIn("unknown method 'cholski'; valid: cholesky, ", error("--method", "cholski"))
        self.assertIn("gradient-symmetric does not differentiate linear fields exactly",
                      error("--normal", "n", "--gradient", "gradient-symmetric"))
        self.assertIn("laplacian-mixed-zoc is not a gradient",
                      error("--normal", "n", "--gradient", "laplacian-mixed-zoc"))
        self.assertIn("diffusivity must be >= 0", error("--diffusivity", -1))
        self.assertIn("--time-step must be finite", error(step=("--time-step", "inf", "--steps", 1)))
        self.assertIn("both to be written to",
                      self.run_program("diffuse", self.points, "--field", "T", "--scheme", "laplacian-mixed-zoc",
                                       "--support", 1, "--time-step", 1, "--steps", 1, "-o", self.path("o.csv"),
                                       "--report", self.path("o.png"), expect=1))
        self.assertIn("diffusivity must be >= 0", error("--diffusivity", "nan"))
        self.assertIn("time_step must be > 0", error(step=("--time-step", -1, "--steps", 1)))
        self.assertIn("--time-step must be finite", error(step=("--time-step", "nan", "--steps", 1)))
        self.assertIn("any constant may be added", error("--steady"))
        self.assertIn("the conductivity at point ", error("--conductivity", "nx"))
        self.assertIn("not: use lu or krylov", error("--method", "cholesky", scheme="laplacian-mixed-soc"))
        self.assertIn("GB given", error("--method", "cholesky", "--memory", 1e-6))
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv"])


if __name__ == "__main__":
    unittest.main()
