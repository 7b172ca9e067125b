"""Clouds that people have: what could not be computed is never a number, and what is said of it helps."""

import math
import re
import subprocess
import unittest

import numpy as np

from program import PROGRAM, ROOT, ProgramTest

CASES = ROOT / "tests" / "cases"


class Clouds(ProgramTest):
    def derive(self, case, scheme, *options, field="T", **expected):
        return self.run_program("derive", CASES / f"{case}.csv", "--field", field, "--scheme", scheme, *options,
                                "-o", self.path("o.csv"), **expected)

    def test_30_points_of_constant_z_are_taken_as_points_in_a_plane(self):
        warning = "all points have z = 0: they are taken as points in 2D"
        self.derive("plane_in_3d", "gradient-ls-2", warning=warning)
        found = self.read_csv("o.csv")
        np.testing.assert_allclose(found["T_x"], 2 * found["x"], atol=2e-3)  # the file has six digits
        np.testing.assert_allclose(found["T_y"], 6 * found["y"], atol=2e-3)
        self.assertNotIn("T_z", found)
        self.derive("plane_in_3d", "laplacian-ls-2", warning=warning)
        np.testing.assert_allclose(self.read_csv("o.csv")["lap_T"], 8, atol=0.1)

    def test_30_other_planes_and_lines_too(self):
        points = self.square(x2=lambda x, y: x * x)
        table = self.read_csv("points.csv")
        upright = self.write_points({"x": table["x"], "y": 0 * table["x"] + 0.25, "z": table["y"], "T": table["x"] * table["y"]},
                                    "upright.csv")
        self.run_program("derive", upright, "--field", "T", "--scheme", "hessian-ls-2", "-o", self.path("o.csv"),
                         warning="all points have y = 0.25")
        found = self.read_csv("o.csv")
        self.assertEqual(list(found)[-3:], ["T_xx", "T_xz", "T_zz"])
        np.testing.assert_allclose(found["T_xz"], 1, rtol=1e-9)
        line = self.write_points({"x": np.zeros(9), "y": np.arange(9.0), "z": np.ones(9), "T": np.arange(9.0)}, "line.csv")
        self.run_program("derive", line, "--field", "T", "--scheme", "gradient-ls-1", "-o", self.path("o.csv"),
                         warning="all points have x = 0 and z = 1: they are taken as points in 1D")
        np.testing.assert_allclose(self.read_csv("o.csv")["T_y"], 1)
        slanted = self.write_points({"x": table["x"], "y": table["y"], "z": table["x"] + 2 * table["y"], "T": table["x2"]},
                                    "slanted.csv")
        error = self.run_program("derive", slanted, "--field", "T", "--scheme", "laplacian-ls-2", "-o", self.path("o.csv"),
                                 expect=1)
        self.assertIn("the points lie in a plane", error)
        self.assertEqual(len(self.read_csv("points.csv")["x"]), 144, points)

    def test_31_points_on_a_surface_are_recognised(self):
        for scheme in ["laplacian-mixed-soc", "laplacian-mixed-soc-ls", "gradient-direct-soc"]:
            error = self.derive("sphere", scheme, "--support-ratio", 3, field="u", expect=1)
            self.assertIn("their neighbours lie on a surface", error)
            self.assertIn("--on-surface computes those within it", error)

    def test_31_surfaces_have_derivatives_within_them(self):
        """The advice of the error before, on u = z, whose surface Laplacian is -2 z."""
        for scheme, tolerance in [("laplacian-mixed-soc-ls", 0.1), ("laplacian-ls-3", 0.1), ("laplacian-positive", 0.1)]:
            self.derive("sphere", scheme, "--neighbours", 30, "--on-surface", field="u")
            found = self.read_csv("o.csv")
            np.testing.assert_allclose(found["lap_u"], -2 * found["z"], atol=tolerance)
        self.derive("sphere", "gradient-ls-2", "--on-surface", field="u")
        found = self.read_csv("o.csv")
        for axis, exact in [("x", -found["z"] * found["x"]), ("y", -found["z"] * found["y"]), ("z", 1 - found["z"] ** 2)]:
            np.testing.assert_allclose(found[f"u_{axis}"], exact, atol=0.02)
        text = self.run_program("inspect", CASES / "sphere.csv", "--scheme", "laplacian-ls-3", "--on-surface")
        self.assertIn("derivatives           fit, exact on polynomials of degree 3", text)
        self.assertIn("implicit steps        fit", text)

    def test_31_a_cloud_is_no_surface(self):
        random = np.random.default_rng(1)
        points = self.write_points(dict(zip("xyzu", random.uniform(size=(4, 500)))))
        error = self.run_program("derive", points, "--field", "u", "--scheme", "laplacian-ls-2", "--neighbours", 30,
                                 "--on-surface", "-o", self.path("o.csv"), expect=1)
        self.assertIn("its neighbours lie on no surface", error)

    def test_31_a_cap_with_a_flux_at_its_edge(self):
        """-lap u = f on a cap of the sphere, half of its edge held; u = z + x y, whose parts have eigenvalues -2, -6."""
        errors = []
        for n in [300, 1200]:
            dx, i = np.sqrt(np.pi / n), np.arange(n)
            z, phi = 1 - (i + 0.5) / n * (0.5 - 0.6 * dx), i * np.pi * (3 - np.sqrt(5))
            t = np.arange(0, 2 * np.pi, 2 * np.pi / round(2 * np.pi * np.sqrt(0.75) / dx))
            edge = np.c_[np.cos(t), np.sin(t), np.full(t.size, 0.5)] * [np.sqrt(0.75), np.sqrt(0.75), 1]
            x, y, z = np.r_[np.c_[np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], edge].T
            held = (np.arange(x.size) >= n) & (x > 0)
            free = (np.arange(x.size) >= n) & ~held
            normal = free * np.array([x * 0.5, y * 0.5, -0.75 * np.ones(x.size)]) / np.sqrt(0.75)
            u, flux = z + x * y, normal[0] * y + normal[1] * x + normal[2]
            points = self.write_points({"x": x, "y": y, "z": z, "T": held * u, "nx": normal[0], "ny": normal[1], "nz": normal[2],
                                        "held": held, "g": flux, "f": 2 * z + 6 * x * y})
            self.run_program("diffuse", points, "--field", "T", "--scheme", "laplacian-ls-2", "--neighbours", 36, "--on-surface",
                             "--on-degenerate", "widen", "--fixed", "held", "--normal", "n", "--flux", "g", "--source", "f",
                             "--steady", "-o", self.path("o.csv"))
            errors.append(np.abs(self.read_csv("o.csv")["T"] - u).max())
        self.assertLess(errors[1], 0.005)
        self.assertGreater(np.log2(errors[0] / errors[1]), 1.7)

    def test_31_heat_on_a_sphere(self):
        """u = z decays by exp(-2 nu t)."""
        self.run_program("diffuse", CASES / "sphere.csv", "--field", "u", "--scheme", "laplacian-ls-3", "--on-surface",
                         "--time-step", 0.01, "--steps", 50, "--theta", 0.5, "-o", self.path("o.csv"))
        found = self.read_csv("o.csv")
        np.testing.assert_allclose(found["u"], found["z"] * np.exp(-1), atol=0.02)

    def test_32_graded_points_need_no_column(self):
        """Every row of an exact scheme, where one support for all left some without neighbours."""
        for scheme, name, exact in [("gradient-ls-1", "T_x", lambda x, y: 3 * np.cos(3 * x) * np.cos(2 * y)),
                                    ("laplacian-ls-2", "lap_T", lambda x, y: -13 * np.sin(3 * x) * np.cos(2 * y))]:
            for options in [[], ["--support-ratio", 3, "--on-degenerate", "widen"], ["--neighbours", 14]]:
                self.derive("graded_10_to_1", scheme, *options)
                found = self.read_csv("o.csv")
                expected = exact(found["x"], found["y"])
                self.assertLess(np.sqrt(np.mean((found[name] - expected) ** 2)), 0.1 * np.abs(expected).max())
        text = self.run_program("advise", CASES / "graded_10_to_1.csv", "--operator", "laplacian", "--tolerance", 0.05)
        self.assertRegex(text, "Take laplacian-[^ ]+ with --support-ratio")
        self.assertIn("808 points in 2D, spacing 0.01", text)

    def test_32_spacings_that_differ_by_direction_are_said(self):
        random = np.random.default_rng(1)
        x, y = (a.ravel() for a in np.meshgrid(np.arange(0.05, 1, 0.1), np.arange(0.005, 1, 0.01)))
        for turn, jitter, direction in [(0, 0, "y"), (0.6, 0, r"\(-?0\.5\d, -?0\.8\d\)"), (0, 0.002, "y")]:
            a, b = (c + random.uniform(-jitter, jitter, c.size) for c in (x, y))
            u, v = np.cos(turn) * a + np.sin(turn) * b, np.cos(turn) * b - np.sin(turn) * a
            points = self.write_points({"x": u, "y": v, "T": u * u + v}, "bars.csv")
            bare = ["derive", points, "--field", "T", "--scheme", "gradient-direct-soc", "-o", self.path("o.csv")]
            said = "spacings differ by direction: along "
            support = "0.3"
            if jitter == 0:
                error = self.run_program(*bare, "--support-ratio", 3, expect=1, warning=said)
                support = re.search(r"; --support (\S+), which reaches across the largest spacings, computes them", error)[1]
                self.assertTrue(0.2 < float(support) < 0.6, support)
            self.run_program(*bare, "--support", support, warning=said)
            np.testing.assert_allclose(self.read_csv("o.csv")["T_x"], 2 * u, atol=1e-9)
            done = subprocess.run([PROGRAM, *map(str, bare), "--support", support], capture_output=True, text=True)
            self.assertRegex(done.stderr, said + direction + r" they are about ([89]|1\d) times smaller than the largest, 0\.(0[789]|1)")

    def test_32_zoc_stays_symmetric_on_graded_points(self):
        bare = ["diffuse", CASES / "graded_10_to_1.csv", "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support-ratio", 3,
                "--time-step", 0.01, "--steps", 3, "-o", self.path("o.csv")]
        text = self.run_program(*bare)
        self.assertIn("supports differ, so that the matrix is not symmetric after scaling by volume", text)
        self.assertIn("the matrix is not symmetric", text)
        text = self.run_program(*bare, "--symmetric-support")
        self.assertNotIn("supports differ", text)
        self.assertIn("solved by Cholesky", text)
        self.derive("graded_10_to_1", "laplacian-mixed-zoc", "--support-ratio", 3, "--symmetric-support")
        error = self.derive("graded_10_to_1", "laplacian-mixed-soc", "--support-ratio", 3, "--symmetric-support", expect=1)
        self.assertIn("laplacian-mixed-soc is not symmetric with any support", error)
        error = self.derive("graded_10_to_1", "laplacian-mixed-zoc", "--support-ratio", 3, "--symmetric-support",
                            "--rows", "T", expect=2)
        self.assertIn("--symmetric-support: needs the rows of all points", error)

    def test_32_a_column_of_supports_is_advised_on_as_it_is(self):
        points = self.square(support=lambda x, y: 0.3 + 0 * x, T=lambda x, y: x)
        text = self.run_program("advise", points, "--operator", "gradient", "--tolerance", 0.1)
        self.assertIn("with the column 'support'", text)
        self.run_program(*text.split("\n    gradpsi ")[1].split("\n")[0].replace("OUT", str(self.path("OUT"))).split())

    def test_33_rows_that_miss_their_conditions_are_degenerate(self):
        close = "points 97 and 98 are 2.06e-05 apart"
        text = self.run_program("inspect", CASES / "thin_strip.csv", "--scheme", "laplacian-mixed-soc-ls", "--support-ratio", 8,
                                "--on-degenerate", "widen", warning=close)
        self.assertIn("degenerate            120: 0 lowered, 0 widened, 120 zero", text)
        self.assertEqual(text.count("not fit: "), 3)
        error = self.derive("thin_strip", "laplacian-mixed-soc-ls", "--support-ratio", 8, "--on-degenerate", "widen",
                            warning=close, expect=1)
        self.assertRegex(error, "120 rows of 120 could not be computed and are nan in .*; the points lie in a line up to 3.7e-10|3.6")
        self.assertTrue(all(map(math.isnan, self.read_csv("o.csv")["lap_T"])))

    def test_34_a_row_without_an_answer_is_nan_unless_zeros_were_asked_for(self):
        points = self.write_points({"x": [0.0, 0.1, 0.2, 0.3, 0.4, 5], "T": [0.0, 1, 2, 3, 4, 5]})
        bare = ["derive", points, "--field", "T", "--scheme", "gradient-direct-foc", "--support", 0.15, "-o", self.path("o.csv")]
        self.run_program(*bare, "--on-degenerate", "zero")
        self.assertEqual(self.read_csv("o.csv")["T_x"][-1], 0)
        for policy in ["lower", "widen"]:
            error = self.run_program(*bare, "--on-degenerate", policy, expect=1)
            self.assertIn("1 row of 6 could not be computed and is nan in", error)
            found = self.read_csv("o.csv")["T_x"]
            np.testing.assert_allclose(found[:-1], 10)
            self.assertTrue(math.isnan(found[-1]))
        text = self.run_program("assemble", points, "--scheme", "gradient-direct-foc", "--support", 0.15, "--on-degenerate",
                                "widen", "-o", self.path("o.mtx"))
        self.assertIn("1 row zero for want of an answer", text.split("\n")[0])

    def test_34_no_free_point_keeps_its_value_for_ever(self):
        points = self.write_points({"x": [0.0, 0.1, 0.2, 0.3, 0.4, 5], "T": [0.0, 1, 2, 3, 4, 5], "held": [1, 0, 0, 0, 1, 1]})
        bare = ["diffuse", points, "--field", "T", "--scheme", "laplacian-mixed-soc-ls", "--support", 0.25, "--on-degenerate",
                "widen", "--time-step", 1, "--steps", 1, "-o", self.path("o.csv")]
        self.run_program(*bare, "--fixed", "held")
        self.assertIn("could not be computed at point 5, which has no condition either", self.run_program(*bare, expect=1))

    def test_32_growth_is_foreseen_where_spacings_vary(self):
        for case, options in [("ring_direct_zoc_grows", ["--scheme", "laplacian-direct-zoc", "--support", 0.13029049555684147,
                                                         "--on-degenerate", "lower", "--kernel", "gaussian", "--fixed", "fixed"]),
                              ("graded_line_grows", ["--scheme", "laplacian-diffuse-ns-soc-ls", "--on-degenerate", "widen"])]:
            text = self.run_program("inspect", CASES / f"{case}.csv", *options)
            self.assertRegex(text, "explicit steps        not fit: fields grow")
            self.assertRegex(text, "implicit steps        not fit: ")

    def test_35_walls_let_no_field_grow(self):
        bare = ["diffuse", CASES / "walls_on_an_l.csv", "--field", "T", "--scheme", "laplacian-positive", "--support", 0.375,
                "--volume", 0.015625, "--on-degenerate", "widen", "--fixed", "fixed", "--normal", "n", "--source", "f",
                "--time-step", 0.0015625, "--steps", 300, "-o", self.path("o.csv")]
        text = self.run_program(*bare)
        self.assertRegex(text, r"T was in \[0, 0.950329\], is in \[-?[0-9.e-]+, 0.0[0-9]*\]")
        self.run_program(*bare, "--gradient", "gradient-direct-foc")
        self.run_program(*bare, "--gradient", "positive")

    def test_37_crank_nicolson_names_the_step_that_does_not_overshoot(self):
        bare = ["diffuse", CASES / "step_between_edges.csv", "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support-ratio",
                3, "--fixed", "wall", "-o", self.path("o.csv")]
        text = self.run_program(*bare, "--time-step", 0.02, "--theta", 0.5, "--steps", 1)
        step = float(re.search(r"nor does --theta 1, nor do steps up to ([\d.e-]+)", text)[1])
        self.assertIn("with --damped-start it does not (tried)", text)
        for options in [["--time-step", 0.02, "--theta", 1, "--steps", 1], ["--time-step", step, "--theta", 0.5, "--steps", 1],
                        ["--time-step", 0.02, "--theta", 0.5, "--damped-start", "--steps", 1],
                        ["--time-step", 0.02, "--theta", 0.5, "--damped-start", "--steps", 7]]:
            text = self.run_program(*bare, *options)
            self.assertNotIn("diffusion alone never leaves", text)

    def test_advice_has_been_tried(self):
        """What an error advises is what then works."""
        points = self.square(T=lambda x, y: x * x)
        bare = ["derive", points, "--field", "T", "--scheme", "laplacian-mixed-soc-ls", "-o", self.path("o.csv")]
        error = self.run_program(*bare, "--support", 0.14, expect=1)
        self.assertIn("; --on-degenerate widen computes them", error)
        self.run_program(*bare, "--support", 0.14, "--on-degenerate", "widen")
        error = self.run_program(*bare, "--support", 0.09, "--on-degenerate", "lower", expect=1)
        self.assertIn("; --on-degenerate widen computes them", error)
        self.run_program(*bare, "--support", 0.09, "--on-degenerate", "widen")

    def test_36_points_that_are_not_what_was_said_are_warned_of(self):
        self.derive("box_not_of_these_points", "gradient-direct-foc", "--support-ratio", 3, "--periodic", "0.9,0",
                    warning="the points span 0.936486 in x, more than the periodic box, 0.9")
        self.derive("box_not_of_these_points", "gradient-direct-foc", "--support-ratio", 3, "--periodic", "1,0")
        self.derive("coincident_other_values", "gradient-direct-foc", "--support-ratio", 3, "--duplicates", "drop",
                    warning="3 dropped points differ from the one in their place that is kept: 'T' by up to 299.947")
        for column, meant in [("h", "support"), ("m", "volume"), ("rho", "volume"), ("Volume", "volume")]:
            points = self.square(T=lambda x, y: x, **{column: lambda x, y: 0 * x + 1})
            self.run_program("derive", points, "--field", "T", "--scheme", "gradient-ls-1", "-o", self.path("o.csv"),
                             warning=f"column '{column}' is taken as a field: what it may be meant for is read from a column "
                                     f"'{meant}'")


if __name__ == "__main__":
    unittest.main()
