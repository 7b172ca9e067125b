"""gradpsi derive."""

import json
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
        self.assertEqual(sorted(mesh.point_data), ["T", "T_x", "T_y", "grad_T", "volume"])
        vector = mesh.point_data.pop("grad_T")
        np.testing.assert_array_equal(vector, np.stack([table["T_x"], table["T_y"], 0 * table["x"]], 1))
        for name, values in mesh.point_data.items():
            np.testing.assert_array_equal(values, table[name])
        self.assertEqual([(c.type, len(c.data)) for c in mesh.cells], [("vertex", 144)])

    def test_a_column_is_not_overwritten(self):
        points = self.square(u=lambda x, y: x, u_x=lambda x, y: y)
        error = self.run_program("derive", points, "--field", "u", "--scheme", "gradient-direct-foc",
                                 "--support", 0.3, "-o", self.path("g.csv"), expect=1)
        self.assertIn("there is already a column 'u_x'", error)
        self.assertFalse(self.path("g.csv").exists())

    def test_several_fields_are_differentiated_each_by_itself(self):
        points = self.square(T=lambda x, y: x * x, p=lambda x, y: x * y, c=lambda x, y: 3 * y)
        bare = ["derive", points, "--support", 0.3, "-o", self.path("d.csv")]
        self.run_program(*bare, "--field", "T,p,c", "--scheme", "gradient-ls-2")
        d = self.read_csv("d.csv")
        x, y = d["x"], d["y"]
        self.assertEqual(list(d)[5:], ["T_x", "T_y", "p_x", "p_y", "c_x", "c_y"])
        for column, exact in [("T_x", 2 * x), ("T_y", 0), ("p_x", y), ("p_y", x), ("c_x", 0), ("c_y", 3)]:
            np.testing.assert_allclose(d[column], exact + 0 * x, atol=1e-9)
        self.run_program(*bare, "--field", "T,p", "--scheme", "laplacian-ls-2", "--what", "laplacian")
        d = self.read_csv("d.csv")
        self.assertEqual(list(d)[5:], ["lap_T", "lap_p"])
        np.testing.assert_allclose(d["lap_T"], 2, atol=1e-7)

    def vectors(self, dimension):
        """A jittered lattice with a quadratic field of vectors."""
        random = np.random.default_rng(2)
        n = {1: 30, 2: 12, 3: 7}[dimension]
        x = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * dimension), -1).reshape(-1, dimension)
        x = np.column_stack([x + random.uniform(-0.2, 0.2, x.shape) / n, np.ones((len(x), 3 - dimension))])
        v = [x[:, 0] * x[:, 1] + 2 * x[:, 2] ** 2, x[:, 0] ** 2 - x[:, 1] * x[:, 2], 3 * x[:, 0] * x[:, 2]]
        columns = {name: column for name, column in zip("xyz", x.T[:dimension])}
        return self.write_points(columns | {"v" + a: c for a, c in zip("xyz"[:dimension], v)}), 3.2 / n

    def of_vectors(self, dimension, what, scheme, output="d.csv", expect=0, field=None):
        points, support = self.vectors(dimension)
        return self.run_program("derive", points, "--field", field or ",".join("v" + a for a in "xyz"[:dimension]),
                                "--what", what, "--scheme", scheme, "--support", support, "-o", self.path(output),
                                expect=expect)

    def test_operators_on_vectors_are_exact_on_quadratics(self):
        cases = [
            (3, "divergence", "gradient-ls-2", {"div_v": lambda x, y, z: y - z + 3 * x}),
            (3, "curl", "gradient-ls-2", {"curl_v_x": lambda x, y, z: y, "curl_v_y": lambda x, y, z: 4 * z - 3 * z,
                                          "curl_v_z": lambda x, y, z: 2 * x - x}),
            (3, "strain", "gradient-direct-soc",
             {"strain_v_xx": lambda x, y, z: y, "strain_v_xy": lambda x, y, z: 1.5 * x,
              "strain_v_xz": lambda x, y, z: 3.5 * z, "strain_v_yy": lambda x, y, z: -z,
              "strain_v_yz": lambda x, y, z: -y / 2, "strain_v_zz": lambda x, y, z: 3 * x}),
            (3, "grad-div", "hessian-ls-2", {"grad_div_v_x": lambda x, y, z: 3, "grad_div_v_y": lambda x, y, z: 1,
                                             "grad_div_v_z": lambda x, y, z: -1}),
            (2, "divergence", "gradient-ls-2", {"div_v": lambda x, y, z: y - 1}),
            (2, "curl", "gradient-ls-2", {"curl_v": lambda x, y, z: 2 * x - x}),
            (1, "divergence", "gradient-ls-2", {"div_v": lambda x, y, z: 1}),
        ]
        for dimension, what, scheme, exact in cases:
            with self.subTest(what=what, dimension=dimension):
                self.of_vectors(dimension, what, scheme)
                d = self.read_csv("d.csv")
                x, y, z = (d.get(a, np.ones(len(d["x"]))) for a in "xyz")
                self.assertEqual(list(d)[2 * dimension:], list(exact))
                for column, value in exact.items():
                    np.testing.assert_allclose(d[column], value(x, y, z) + 0 * x, atol=1e-7)

    def test_vectors_are_vectors_in_vtu(self):
        for dimension, vectors in [(3, {"v": "v{}", "curl_v": "curl_v_{}"}), (2, {"v": "v{}"})]:
            for output in ["d.csv", "d.vtu"]:
                self.of_vectors(dimension, "curl", "gradient-ls-2", output)
            table, data = self.read_csv("d.csv"), meshio.read(self.path("d.vtu")).point_data
            for name, column in vectors.items():
                columns = [table.get(column.format(a), 0 * table["x"]) for a in "xyz"]
                np.testing.assert_array_equal(data.pop(name), np.stack(columns, 1))
            self.assertEqual(sorted(data), sorted(set(table) - set("xyz")))

    def test_vectors_are_named_by_what_their_components_share(self):
        x, y = np.random.default_rng(1).random((2, 60))
        columns = {"x": x, "y": y, "u": x, "w": y, "vel_x": x, "vel_y": y, "ax": x, "ay": y, "a": x}
        points = self.write_points(columns)
        for field, name in [("u,w", "u_w"), ("vel_x,vel_y", "vel"), ("ax,ay", "ax_ay"), ("w,u", "w_u"), ("x,y", "x_y")]:
            self.run_program("derive", points, "--field", field, "--what", "divergence", "--scheme", "gradient-ls-1",
                             "-o", self.path("d.vtu"))
            data = meshio.read(self.path("d.vtu")).point_data
            self.assertIn("div_" + name, data)
            self.assertEqual(data[name].shape, (60, 3))

    def test_points_in_a_plane_have_its_curl(self):
        random = np.random.default_rng(1)
        x, z = random.random((2, 80))
        points = self.write_points({"x": x, "y": 0 * x + 2, "z": z, "vx": z, "vz": 3 * x})
        bare = ["derive", points, "--scheme", "gradient-ls-1", "--field", "vx,vz", "-o"]
        warning = "points in 2D"
        self.run_program(*bare, self.path("c.csv"), "--what", "curl", warning=warning)
        np.testing.assert_allclose(self.read_csv("c.csv")["curl_v"], 2, atol=1e-9)
        self.run_program(*bare, self.path("s.csv"), "--what", "strain", warning=warning)
        self.assertEqual(list(self.read_csv("s.csv"))[5:], ["strain_v_xx", "strain_v_xz", "strain_v_zz"])
        self.run_program(*bare, self.path("s.vtu"), "--what", "strain", warning=warning)
        v = meshio.read(self.path("s.vtu")).point_data["v"]
        np.testing.assert_array_equal(v[:, 1], 0)
        np.testing.assert_allclose(v[:, 2], 3 * x)

    def test_combinations_without_a_meaning_are_refused(self):
        refused = [
            (dict(dimension=3, field="vx,vy"), "divergence", "gradient-ls-1",
             "--field: the divergence of points in 3D takes 3 columns, the components along xyz, not 2"),
            (dict(dimension=2, field="vx"), "curl", "gradient-ls-1",
             "--field: the curl of points in 2D takes 2 columns, the components along xy, not 1"),
            (dict(dimension=2), "curl", "laplacian-ls-2",
             "--scheme: --what curl takes a scheme of a gradient, not laplacian-ls-2"),
            (dict(dimension=2), "grad-div", "gradient-ls-1", "takes a scheme of a hessian, not gradient-ls-1"),
            (dict(dimension=2), "laplacian", "gradient-ls-1", "takes a scheme of a laplacian, not gradient-ls-1"),
            (dict(dimension=1), "curl", "gradient-ls-1", "--what: there is no curl in 1D"),
            (dict(dimension=2, field="vy,vx"), "curl", "gradient-ls-1",
             "--field: the components of a vector come in the order of their axes, vx,vy"),
            (dict(dimension=2, field="vx,vx"), "curl", "gradient-ls-1", "--field: column 'vx' is there twice"),
            (dict(dimension=2, field="vx,"), "curl", "gradient-ls-1", "--field: a name is missing in 'vx,'"),
            (dict(dimension=2), "rotation", "gradient-ls-1", "--what"),
        ]
        for where, what, scheme, words in refused:
            self.assertIn(words, self.of_vectors(**where, what=what, scheme=scheme, expect=2))
        self.assertIn("unknown column 'vw'", self.of_vectors(2, "curl", "gradient-ls-1", field="vx,vw", expect=1))
        self.assertFalse(self.path("d.csv").exists())
        random = np.random.default_rng(1).normal(size=(200, 3))
        x, y, z = (random / np.linalg.norm(random, axis=1)[:, None]).T
        sphere = self.write_points({"x": x, "y": y, "z": z, "vx": x, "vy": y, "vz": z})
        bare = ["derive", sphere, "--field", "vx,vy,vz", "--on-surface", "--neighbours", 20, "-o", self.path("d.csv"),
                "--scheme", "gradient-ls-2", "--what"]
        error = self.run_program(*bare, "curl", expect=2)
        self.assertIn("--on-surface: of vectors on a surface there is the divergence only", error)
        self.run_program(*bare, "divergence")  # of the normal: the sum of the curvatures
        self.assertLess(np.median(np.abs(self.read_csv("d.csv")["div_v"] - 2)), 0.05)

    def test_vectors_at_rows_without_an_answer_are_nan(self):
        table = {name: np.append(column, 9) for name, column in
                 (self.vectors(2), self.read_csv("points.csv"))[1].items()}
        isolated = self.write_points(table, "isolated.csv")
        bare = ["derive", isolated, "--field", "vx,vy", "--what", "strain", "--scheme", "gradient-ls-1", "--support", 0.3,
                "--on-degenerate", "widen", "-o", self.path("d.csv")]
        error = self.run_program(*bare, expect=1)
        self.assertIn("1 row of 145 could not be computed and is nan in", error)
        d = self.read_csv("d.csv")
        for column in ["strain_v_xx", "strain_v_xy", "strain_v_yy"]:
            self.assertEqual(np.flatnonzero(np.isnan(d[column])).tolist(), [144])

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

    def test_values_and_derivatives_at_probes(self):
        points = self.square(u=lambda x, y: x * x - 3 * x * y + 2 * y, v=lambda x, y: y * y)
        x, y = np.random.default_rng(4).random((2, 30)) * 0.9 + 0.05
        probes = self.write_points({"name": np.arange(30.0), "x": x, "y": y}, "probes.csv")
        exact = {"value": {"u": x * x - 3 * x * y + 2 * y, "v": y * y}, "laplacian": {"lap_u": 2, "lap_v": 2},
                 "gradient": {"u_x": 2 * x - 3 * y, "u_y": 2 - 3 * x, "v_x": 0, "v_y": 2 * y},
                 "hessian": {"u_xx": 2, "u_xy": -3, "u_yy": 0, "v_xx": 0, "v_xy": 0, "v_yy": 2}}
        for derivative, columns in exact.items():
            text = self.run_program("derive", points, "--field", "u,v", "--scheme", derivative + "-mls-2", "--at", probes,
                                    "-o", self.path("there.csv"), "--report", self.path("r.json"))
            self.assertIn("144 points, 30 probes, ", text)
            there = self.read_csv("there.csv")
            self.assertEqual(list(there), ["name", "x", "y", *columns])
            for column, value in columns.items():
                np.testing.assert_allclose(there[column], value + 0 * x, atol=1e-8)
            report = json.loads(self.path("r.json").read_text())
            self.assertEqual((report["points"], report["probes"]), (144, 30))
            self.assertGreater(report["neighbours"]["min"], 5)
        self.run_program("derive", points, "--field", "u,v", "--what", "divergence", "--scheme", "gradient-mls-2", "--at",
                         probes, "-o", self.path("there.vtu"))
        data = meshio.read(self.path("there.vtu")).point_data
        np.testing.assert_allclose(data["div_u_v"], 2 * x - 3 * y + 2 * y, atol=1e-8)

    def test_probes_of_a_velocity_have_its_vector(self):
        points = self.square(vx=lambda x, y: x + y, vy=lambda x, y: x - y)
        probes = self.write_points({"x": [0.3, 0.6], "y": [0.4, 0.7]}, "probes.csv")
        self.run_program("derive", points, "--field", "vx,vy", "--scheme", "value-mls-1", "--at", probes, "-o",
                         self.path("there.vtu"))
        data = meshio.read(self.path("there.vtu")).point_data
        np.testing.assert_allclose(data["v"], [[0.7, -0.1, 0], [1.3, -0.1, 0]], atol=1e-12)

    def test_probes_that_cannot_be_are_refused(self):
        points = self.square(u=lambda x, y: x)
        x = np.array([0.5, 2.0, 0.3])
        probes = self.write_points({"x": x, "y": x}, "probes.csv")
        bare = ["derive", points, "--field", "u", "--at", probes, "-o", self.path("there.csv")]
        error = self.run_program(*bare, "--scheme", "value-mls-1", expect=1)
        self.assertRegex(error, r"1 of 3 probes is outside the cloud: probe 1 at \(2, 2\), 1\.4\d from point 143")
        self.assertIn("gradient-mls-P", self.run_program(*bare, "--scheme", "gradient-ls-1", "--support", 0.3, expect=1))
        self.assertIn("is the file of the probes", self.run_program(*bare[:-1], probes, "--scheme", "value-mls-1", expect=1))
        for columns, words in [({"x": [0.5]}, "y"), ({"x": [0.5], "y": [0.5], "u": [1]}, "there is already a column 'u'"),
                               ({"x": [0.5], "y": [0.5], "z": [0.1]}, "probe 0 has z = 0.1, the points have no z")]:
            wrong = self.write_points({name: np.array(column) for name, column in columns.items()}, "wrong.csv")
            error = self.run_program("derive", points, "--field", "u", "--at", wrong, "--scheme", "value-mls-1", "-o",
                                     self.path("there.csv"), expect=1)
            self.assertIn("wrong.csv: ", error)
            self.assertIn(words, error)
        inside = self.write_points({"x": [0.52], "y": [0.5]}, "inside.csv")
        error = self.run_program("derive", points, "--field", "u", "--at", inside, "--scheme", "value-mls-4", "--support",
                                 0.15, "-o", self.path("there.csv"), expect=1)
        self.assertRegex(error, r"probe 0: at least 14.*at \(0\.52, 0\.5\)\).*; without a support, each probe has one")
        wrong = self.write_points({"x": [0.5, 0.5], "y": [0.5, float("nan")]}, "nan.csv")
        error = self.run_program("derive", points, "--field", "u", "--at", wrong, "--scheme", "value-mls-1", "-o",
                                 self.path("there.csv"), expect=1)
        self.assertIn("probe 1 has a coordinate that is not finite", error)
        for wrong, option in [(["--on-degenerate", "zero"], "--on-degenerate"), (["--on-surface"], "--on-surface"),
                              (["--rows", "u"], "--rows"), (["--symmetric-support"], "--symmetric-support")]:
            self.assertIn(option, self.run_program(*bare, "--scheme", "value-mls-1", *wrong, expect=2))
        error = self.run_program("derive", points, "--field", "u", "--scheme", "value-mls-1", "-o", self.path("o.csv"),
                                 expect=2)
        self.assertIn("--at PROBES.csv", error)
        self.assertFalse(self.path("there.csv").exists())
        flat = self.write_points({"x": [0, 1, 2, 3.], "y": [1.] * 4, "u": [0, 1, 2, 3.]}, "flat.csv")
        for height, expect in [(1, 0), (1.5, 1)]:
            probes = self.write_points({"x": [1.5], "y": [float(height)]}, "probes.csv")
            said = self.run_program("derive", flat, "--field", "u", "--scheme", "value-mls-1", "--at", probes, "-o",
                                    self.path("there.csv"), expect=expect, warning="points in 1D")
            if expect:
                self.assertIn("probe 0 has y = 1.5, all points y = 1", said)
        self.assertAlmostEqual(self.read_csv("there.csv")["u"][0], 1.5)


if __name__ == "__main__":
    unittest.main()
