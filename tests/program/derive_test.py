"""gradpsi derive."""

import re
import unittest

import meshio
import numpy as np

from program import ProgramTest


class Derive(ProgramTest):
    def test_derivatives_of_a_quadratic_are_exact(self):
        points = self.square(u=lambda x, y: x * x - 3 * x * y + 2 * y)
        bare = ["derive", points, "--field", "u", "--support", 0.3]
        self.run_program(*bare, "--scheme", "gradient-diffuse-soc", "-o", self.path("g.csv"))
        g = self.read_csv("g.csv")
        self.assertEqual(list(g), ["x", "y", "u", "u_x", "u_y"])
        np.testing.assert_allclose(g["u_x"], 2 * g["x"] - 3 * g["y"], atol=1e-9)
        np.testing.assert_allclose(g["u_y"], 2 - 3 * g["x"], atol=1e-9)
        text = self.run_program(*bare, "--scheme", "laplacian-diffuse-soc", "-o", self.path("l.csv"))
        found = re.search(r"smallest reciprocal condition number (\S+), at point (\d+)\n", text)
        self.assertTrue(0 < float(found[1]) < 1)
        self.assertTrue(0 <= int(found[2]) < 144)
        lap = self.read_csv("l.csv")
        self.assertEqual(list(lap), ["x", "y", "u", "lap_u"])
        np.testing.assert_allclose(lap["lap_u"], 2, atol=1e-7)
        self.run_program(*bare, "--scheme", "hessian-mixed-soc-ls", "-o", self.path("h.csv"))
        h = self.read_csv("h.csv")
        self.assertEqual(list(h), ["x", "y", "u", "u_xx", "u_xy", "u_yy"])
        for column, exact in [("u_xx", 2), ("u_xy", -3), ("u_yy", 0)]:
            np.testing.assert_allclose(h[column], exact, atol=1e-7)

    def test_vtu_holds_the_same_numbers(self):
        points = self.square(T=lambda x, y: np.sin(x + y), volume=lambda x, y: 0 * x + 1 / 144)
        bare = ["derive", points, "--field", "T", "--scheme", "gradient-direct-foc", "--support", 0.3]
        self.run_program(*bare, "-o", self.path("g.csv"))
        self.run_program(*bare, "-o", self.path("g.vtu"))
        table = self.read_csv("g.csv")
        mesh = meshio.read(self.path("g.vtu"))
        np.testing.assert_array_equal(mesh.points, np.stack([table["x"], table["y"], 0 * table["x"]], 1))
        self.assertEqual(sorted(mesh.point_data), ["T", "T_x", "T_y", "volume"])
        for name, values in mesh.point_data.items():
            np.testing.assert_array_equal(values, table[name])
        self.assertEqual([(c.type, len(c.data)) for c in mesh.cells], [("vertex", 144)])

    def test_a_column_is_not_overwritten(self):
        points = self.square(u=lambda x, y: x, u_x=lambda x, y: y)
        error = self.run_program("derive", points, "--field", "u", "--scheme", "gradient-direct-foc",
                                 "--support", 0.3, "-o", self.path("g.csv"), expect=1)
        self.assertIn("there is already a column 'u_x'", error)
        self.assertFalse(self.path("g.csv").exists())

    def fluid_and_walls(self):
        """A lattice, and beside it one layer of points whose rows have no answer."""
        x, y = (a.ravel() for a in np.meshgrid(np.arange(0.05, 1, 0.1), np.append(np.arange(0.05, 1, 0.1), -0.15)))
        return self.write_points({"x": x, "y": y, "T": x * x + 3 * y, "fluid": y > 0, "nowhere": 0 * x})

    def test_only_the_rows_that_are_wanted_are_computed(self):
        bare = ["derive", self.fluid_and_walls(), "--field", "T", "--scheme", "gradient-direct-soc", "--support", 0.22]
        error = self.run_program(*bare, "-o", self.path("g.csv"), expect=1)
        self.assertIn("; --rows COLUMN, a column that is 0 at these points, computes the 100 others", error)
        self.assertFalse(self.path("g.csv").exists())
        for policy in [[], ["--on-degenerate", "lower"]]:
            text = self.run_program(*bare, *policy, "--rows", "fluid", "-o", self.path("g.csv"))
            self.assertIn("gradient-direct-soc: 100 of 110 points, ", text)
            g = self.read_csv("g.csv")
            fluid = g["fluid"] == 1
            np.testing.assert_allclose(g["T_x"][fluid], 2 * g["x"][fluid], atol=1e-9)
            np.testing.assert_allclose(g["T_y"][fluid], 3, atol=1e-9)
            self.assertTrue(np.isnan(g["T_x"][~fluid]).all() and np.isnan(g["T_y"][~fluid]).all())
        self.run_program(*bare, "--rows", "fluid", "-o", self.path("g.vtu"))
        np.testing.assert_array_equal(meshio.read(self.path("g.vtu")).point_data["T_x"], g["T_x"])

    def test_wanted_rows_without_an_answer_fail_as_ever(self):
        points = self.fluid_and_walls()
        table = self.read_csv("points.csv")
        isolated = self.write_points({name: np.append(column, 9) for name, column in table.items()}, "isolated.csv")
        bare = ["--field", "T", "--scheme", "gradient-ls-1", "--support", 0.2, "--on-degenerate", "widen",
                "-o", self.path("g.csv")]
        error = self.run_program("derive", isolated, *bare, "--rows", "fluid", expect=1)
        self.assertIn("1 row of 101 could not be computed and is nan in", error)
        self.assertIn("; --rows COLUMN, a column that is 0 at this point, computes the 100 others", error)
        self.assertEqual(np.flatnonzero(np.isnan(self.read_csv("g.csv")["T_x"])).tolist(), [*range(100, 111)])
        error = self.run_program("derive", points, *bare, "--rows", "nowhere", expect=1)
        self.assertIn("column 'nowhere' is 0 at all points", error)


if __name__ == "__main__":
    unittest.main()
