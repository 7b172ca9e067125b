"""The program as scripts see it: options, files, exit codes. Run by CTest, one class at a time."""

import ast
import csv
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

import meshio
import numpy as np
import scipy.io
import scipy.optimize
import scipy.sparse
import scipy.sparse.linalg

PROGRAM = os.environ["GRADPSI_PROGRAM"]
REFERENCE = Path(__file__).parent / "reference"


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def path(self, name):
        return self.folder / name

    def run_program(self, *arguments, expect=0):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(done.returncode, expect, done.stderr)
        if expect == 0:
            self.assertEqual(done.stderr, "")  # no progress bar away from a terminal
        else:
            self.assertTrue(done.stderr.startswith("error: "), done.stderr)
        return done.stdout if expect == 0 else done.stderr

    def write_points(self, columns, name="points.csv"):
        names = list(columns)
        with open(self.path(name), "w") as out:
            print(",".join(names), file=out)
            for row in zip(*columns.values()):
                print(",".join(repr(float(x)) for x in row), file=out)
        return self.path(name)

    def square(self, n=12, seed=1, **columns):
        """A jittered lattice on the unit square."""
        random = np.random.default_rng(seed)
        x, y = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
        x = x.ravel() + random.uniform(-0.2, 0.2, n * n) / n
        y = y.ravel() + random.uniform(-0.2, 0.2, n * n) / n
        columns = {name: f(x, y) for name, f in columns.items()}
        return self.write_points({"x": x, "y": y, **columns})

    def read_csv(self, name):
        with open(self.path(name)) as file:
            rows = list(csv.DictReader(file))
        return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


class Readme(unittest.TestCase):
    def test_it_quotes_the_examples_to_the_letter(self):
        root = Path(__file__).parent.parent
        for example in (root / "apps" / "examples").glob("*.cpp"):
            self.assertIn("```cpp\n" + example.read_text() + "```\n", (root / "README.md").read_text())
        example = root / "apps" / "python" / "example.py"
        self.assertIn("```python\n" + example.read_text() + "```\n", (root / "README.md").read_text())

    def test_it_names_every_kernel(self):
        done = subprocess.run([PROGRAM, "assemble", "--help"], capture_output=True, text=True)
        kernels = re.search("One of (wendland.*)", done.stdout).group(1)
        for kernel in kernels.split(", "):
            self.assertIn("`" + kernel.strip() + "`", (Path(__file__).parent.parent / "README.md").read_text())


class Schemes(ProgramTest):
    def test_json_lists_the_seventeen_first(self):
        schemes = json.loads(self.run_program("schemes", "--json"))
        self.assertEqual([s["consistency"] in ("zoc", "foc", "soc") for s in schemes], [True] * 17 + [False] * 15)
        mixed = next(s for s in schemes if s["name"] == "laplacian-mixed-zoc")
        self.assertEqual(mixed["formula"], "omega_j (-2 W'/r)")
        self.assertEqual(mixed["volume_scaled_symmetry"], "symmetric")

    def test_table_has_a_line_for_each(self):
        text = self.run_program("schemes")
        for scheme in json.loads(self.run_program("schemes", "--json")):
            self.assertIn("\n" + scheme["name"] + " ", text)

    def test_help_and_version(self):
        self.assertIn("assemble", self.run_program("--help"))
        self.assertRegex(self.run_program("--version"), r"^\d+\.\d+\.\d+\n$")


class Help(ProgramTest):
    def commands(self):
        listed = self.run_program("--help").split("Subcommands:\n")[1].split("\n\n")[0]
        return re.findall(r"^  (\w+)  ", listed, re.M)

    def examples(self, *command):
        text = self.run_program(*command, "--help").replace("\\\n", " ")
        return re.findall(r"^(?:Example: |  )gradpsi (\w+ .*)$", text, re.M)

    def test_every_help_shows_an_example_that_runs(self):
        self.square(n=20, T=lambda x, y: np.cos(4 * x + y), wall=lambda x, y: x < 0.1)
        self.assertGreaterEqual(len(self.commands()), 11)
        examples = self.examples()  # of the program itself; later ones use what it writes
        self.assertTrue(examples)
        for command in self.commands():
            own = [e for e in self.examples(command) if e.startswith(command + " ")]
            self.assertTrue(own, command)
            examples += own
        for example in examples:
            if example.split()[0] in ("converge", "stability", "tradeoff"):
                self.assertRegex(example, r"^\w+ --quick --out results$")  # run by the tests of their names
                continue
            arguments = example.split("|")[0].split()
            done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, cwd=self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""), example)
            for output in re.findall(r"-o (\S+)", example):
                stem, end = output.rsplit(".", 1)
                made = [self.path(output), self.path(f"{stem}_x.{end}")]
                self.assertTrue("|" in example or any(file.exists() for file in made), output)

    def test_the_manual_page_is_sound_and_complete(self):
        page = self.run_program("manual")
        rendered = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-P-cbou"], input=page.encode(), capture_output=True)
        self.assertEqual((rendered.returncode, rendered.stderr), (0, b""))
        text = " ".join(rendered.stdout.decode().replace("\u2010\n", "").split())
        for command in self.commands():
            self.assertIn("gradpsi " + command, text)
            for option in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", self.run_program(command, "--help"), re.M):
                self.assertTrue(option == "--help" or option in text, option)


class Assemble(ProgramTest):
    def test_reference_matrices(self):
        for cloud, support in [("line", "0.10416666666666666"), ("square", "0.3571428571428571")]:
            points = REFERENCE / f"{cloud}.csv"
            n = sum(1 for _ in open(points)) - 1
            reference = {}
            with open(REFERENCE / f"{cloud}.triplets.csv") as file:
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
                                "-o", self.path("a.mtx"))
        self.assertIn("coincident points dropped: 2\n", text)
        self.assertEqual(scipy.io.mmread(self.path("a_x.mtx")).shape, (5, 5))
        self.assertEqual(json.loads(self.path("r.json").read_text())["dropped_points"], 2)
        self.run_program("derive", *bare[1:], "--field", "T", "--duplicates", "drop",
                         "-o", self.path("t.csv"))
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


class DiffusionScene(ProgramTest):
    def setUp(self):
        super().setUp()
        self.points = self.square(
            20, T=lambda x, y: np.sin(3 * x) + np.cos(5 * y), wall=lambda x, y: x < 0.05,
            nx=lambda x, y: x > 0.95, ny=lambda x, y: 0 * x, flux=lambda x, y: y,
            f=lambda x, y: x * y, kappa=lambda x, y: np.exp(x - y))
        self.table = self.read_csv("points.csv")


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
        t, n, nu, dt = self.table, 400, 0.3, 2e-3
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
                             "--conductivity", "kappa", "--mean", "harmonic", "--method", method)
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
        for arguments in [[], ["--steps", 1], ["--time-step", 1], [*step, "--theta", 0.7], [*step, "--flux", "f"],
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


@unittest.skipUnless(os.environ.get("GRADPSI_MPIRUN"), "built without PETSc")
class Mpi(DiffusionScene):
    """gradpsi-mpi does what gradpsi does, whatever the number of processes; what goes wrong ends all of them."""

    def run_mpi(self, processes, *arguments, expect=0):
        done = subprocess.run([*os.environ["GRADPSI_MPIRUN"].split(), "-n", str(processes), os.environ["GRADPSI_MPI"],
                               *map(str, arguments)], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, expect, done.stderr + done.stdout)
        if expect != 0:
            self.assertEqual(done.stderr.count("error: "), 1, done.stderr)
            return done.stderr
        self.assertNotIn("error", done.stderr)
        return done.stdout + done.stderr

    def same_as_one(self, *arguments, processes=(1, 2, 3, 4), tolerance=1e-9):
        """Runs both; the text of gradpsi-mpi with the most processes."""
        points, *more = arguments
        one = ["diffuse", points, "--field", "T", *more, "--report", self.path("one.json"), "-o", self.path("one.csv")]
        self.run_program(*one)
        expected = self.read_csv("one.csv")
        report = json.loads(self.path("one.json").read_text())
        for count in processes:
            text = self.run_mpi(count, "diffuse", points, "--field", "T", *more,
                                "--report", self.path("mpi.json"), "-o", self.path("mpi.csv"))
            found = self.read_csv("mpi.csv")
            self.assertEqual(list(found), list(expected))
            for name in set(expected) - {"T"}:
                np.testing.assert_array_equal(found[name], expected[name])
            np.testing.assert_allclose(found["T"], expected["T"], rtol=0, atol=tolerance * np.abs(expected["T"]).max())
            of_mpi = json.loads(self.path("mpi.json").read_text())
            self.assertEqual(of_mpi["processes"], count)
            for name in ["points", "entries", "neighbours", "degenerate_rows", "dropped_points", "degenerate"]:
                self.assertEqual(of_mpi.get(name), report.get(name), name)
        return text

    def test_walls_sources_and_conductivities(self):
        for scheme, more in [("laplacian-mixed-zoc", ["--time-step", 2e-3, "--steps", 3]),
                             ("laplacian-mixed-soc", ["--time-step", 2e-3, "--steps", 3, "--theta", 0.5]),
                             ("laplacian-mixed-zoc", ["--steady"])]:
            text = self.same_as_one(self.points, "--scheme", scheme, "--support", 0.15, "--fixed", "wall",
                                    "--normal", "n", "--flux", "flux", "--source", "f", "--conductivity", "kappa",
                                    "--mean", "harmonic", *more)
            self.assertIn("PETSc, 4 processes", text)
            self.assertIn("picture: ", text)

    def test_widened_rows_and_number_densities(self):
        self.same_as_one(self.points, "--scheme", "laplacian-mixed-soc", "--support-ratio", 2, "--on-degenerate", "widen",
                         "--fixed", "wall", "--time-step", 1e-3, "--steps", 2, tolerance=1e-8)
        text = self.same_as_one(self.points, "--scheme", "laplacian-positive", "--fixed", "wall", "--time-step", 1e-3,
                                "--steps", 2)
        self.assertIn("degenerate rows: ", text)

    def test_a_periodic_box_supports_and_duplicates(self):
        t = self.table
        columns = {name: np.concatenate([t[name], t[name][5:300:70]]) for name in ["x", "y", "T"]}
        columns["support"] = np.linspace(0.14, 0.17, len(columns["x"]))
        points = self.write_points(columns, "twice.csv")
        self.same_as_one(points, "--scheme", "laplacian-mixed-zoc", "--periodic", "1,1", "--duplicates", "drop",
                         "--volume", 0.0025, "--time-step", 1e-3, "--steps", 2)
        for processes in [1, 3]:
            self.assertIn("points 5 and 400 coincide",
                          self.run_mpi(processes, "diffuse", points, "--field", "T", "--scheme", "laplacian-mixed-zoc",
                                       "--time-step", 1, "--steps", 1, "-o", self.path("o.csv"), expect=1))

    def test_more_processes_than_points(self):
        points = self.write_points({"x": [0, 0.1, 0.2], "T": [1, 0, 0]}, "three.csv")
        self.same_as_one(points, "--scheme", "laplacian-mixed-zoc", "--support", 0.15, "--volume", 0.1,
                         "--time-step", 1e-3, "--steps", 2, processes=[2, 5])
        self.path("none.csv").write_text("x,T\n")
        self.run_mpi(3, "diffuse", self.path("none.csv"), "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", 1,
                     "--time-step", 1, "--steps", 1, "-o", self.path("o.csv"))
        self.assertEqual(self.path("o.csv").read_text(), "x,T\n")

    def test_pieces_are_the_whole(self):
        steps = ["--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", 0.15, "--time-step", 1e-3, "--steps", 10,
                 "--every", 5, "-o"]
        self.run_program("diffuse", self.points, *steps, self.path("one.vtu"))
        self.run_mpi(3, "diffuse", self.points, *steps, self.path("mpi.vtu"))
        for number in ["", "_00", "_05", "_10"]:
            whole = meshio.read(self.path(f"one{number}.vtu"))
            tree = xml.etree.ElementTree.parse(self.path(f"mpi{number}.pvtu"))
            pieces = [meshio.read(self.path(piece.attrib["Source"])) for piece in tree.iter("Piece")]
            self.assertEqual(len(pieces), 3)
            np.testing.assert_array_equal(np.concatenate([p.points for p in pieces]), whole.points)
            self.assertEqual([a.attrib["Name"] for a in tree.find(".//PPointData")], list(whole.point_data))
            for name, values in whole.point_data.items():
                np.testing.assert_allclose(np.concatenate([p.point_data[name] for p in pieces]), values, atol=1e-9)
        listed = [d.attrib["file"] for d in xml.etree.ElementTree.parse(self.path("mpi.pvd")).iter("DataSet")]
        self.assertEqual(listed, ["mpi_00.pvtu", "mpi_05.pvtu", "mpi_10.pvtu"])

    def test_options_of_petsc_go_before_what_is_chosen(self):
        steps = ["diffuse", self.points, "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", 0.15, "--time-step",
                 1e-3, "--steps", 1, "-o", self.path("o.csv")]
        text = self.run_mpi(2, *steps, "-ksp_type", "gmres", "-pc_type", "asm", "-ksp_monitor", "-ksp_typo", "-1e-3")
        self.assertIn("solved by gmres preconditioned by asm (PETSc, 2 processes)", text)
        self.assertIn("KSP Residual norm", text)
        self.assertIn("warning: PETSc did not use the option -ksp_typo", text)
        self.assertIn("cannot find", self.run_mpi(2, *steps, "-ksp_type", "nonsense", expect=1).replace("Unable to find", "cannot find"))
        for method in ["cholesky", "lu"]:
            self.assertIn("by MUMPS (PETSc, 2 processes)", self.run_mpi(2, *steps, "--method", method))
        for options in [["-ksp_type", "gmres", "-pc_type", "asm"], ["-ksp_type", "gmres", "-pc_type", "bjacobi"],
                        ["--method", "lu", "--memory", "inf"]]:
            self.run_mpi(3, *steps, *options)  # preconditioned residuals, too, must end below the tolerance
        self.assertIn("PETSc Performance Summary", self.run_mpi(2, *steps, "-log_view"))
        self.assertIn("tolerance must be between 0 and 1, not 2", self.run_mpi(2, *steps, "-ksp_rtol", 2, expect=1))
        self.assertIn("the factor does not fit the memory",
                      self.run_mpi(2, *steps, "--method", "lu", "--memory", 1e-4, expect=1))

    def test_an_error_ends_all_processes(self):
        steps = ["--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", 0.15, "--time-step", 1e-3, "--steps", 1, "-o"]
        lines = self.points.read_text().splitlines()
        broken = self.path("broken.csv")
        broken.write_text("\n".join([*lines[:370], "1,2", *lines[370:]]))  # only one process reads it
        self.assertIn("broken.csv:371: 2 columns where the header has 9 (on rank 2 of 3)",
                      self.run_mpi(3, "diffuse", broken, *steps, self.path("o.csv"), expect=1))
        self.assertIn("unknown column 'U'", self.run_mpi(
            2, "diffuse", self.points, "--field", "U", *steps[2:], self.path("o.csv"), expect=1))
        self.assertIn("the 400 rows connected with that of point 0", self.run_mpi(
            3, "diffuse", self.points, *steps[:6], "--steady", "-o", self.path("o.csv"), expect=1))
        full = self.path("full.csv")  # only the first process writes
        full.symlink_to("/dev/full")
        self.assertIn("No space left", self.run_mpi(3, "diffuse", self.points, *steps, full, expect=1))
        self.assertIn("Usage: gradpsi-mpi", self.run_mpi(2, "diffuse", self.points, expect=2))
        self.assertIn("unknown subcommand 'derive'; valid: diffuse", self.run_mpi(2, "derive", expect=2))
        self.assertFalse(self.path("o.csv").exists())

    def test_a_process_that_is_killed_ends_all(self):
        script = self.path("one_dies.sh")
        script.write_text("#!/bin/bash\n[ $OMPI_COMM_WORLD_RANK = 1 ] && ulimit -v 200000\nexec \"$@\"\n")
        script.chmod(0o755)
        done = subprocess.run([*os.environ["GRADPSI_MPIRUN"].split(), "-n", "3", script, os.environ["GRADPSI_MPI"],
                               "diffuse", self.points, "--field", "T", "--scheme", "laplacian-mixed-zoc", "--support", "0.15",
                               "--steady", "-o", self.path("o.csv")], capture_output=True, text=True, timeout=120)
        self.assertNotEqual(done.returncode, 0)

    def test_help_shows_examples_that_run(self):
        self.square(n=20, T=lambda x, y: np.cos(4 * x + y), wall=lambda x, y: x < 0.1)
        examples = []
        for command in [["--help"], ["diffuse", "--help"]]:
            text = self.run_mpi(2, *command)
            examples += re.findall(r"mpirun -n 2 gradpsi-mpi (.*)$", text.replace("\\\n", " "), re.M)
        self.assertEqual(len(examples), 3)
        for example in examples:
            words = [str(self.path(w)) if re.search(r"\.(csv|vtu)$", w) else w for w in example.split()]
            self.run_mpi(2, *words)


class DiffusionStudy(unittest.TestCase):
    def test_orders_and_known_errors(self):
        done = subprocess.run([os.environ["GRADPSI_DIFFUSION_STUDY"], "--quick"], capture_output=True,
                              text=True, check=True)
        rows = list(csv.DictReader(done.stdout.splitlines()))
        self.assertEqual({(r["of"], r["dimension"], r["walls"]) for r in rows},
                         {(of, d, w) for of in ["time", "space"] for d in "123" for w in ["fixed", "no-flux"]}
                         | {(of, "2", "fixed") for of in ["poisson", "slab-harmonic", "slab-arithmetic"]})
        expected = {"backward-euler": (0.9, 1.1), "crank-nicolson": (1.9, 2.1)}
        errors = {}
        for r in rows:
            if r["of"] == "time" and r["order"]:
                low, high = expected[r["method"]]
                self.assertTrue(low < float(r["order"]) < high, r)
            if r["of"] == "slab-harmonic":
                self.assertLess(float(r["error"]), 0.002, r)
            if r["of"] == "slab-arithmetic":
                self.assertGreater(float(r["error"]), 0.005, r)
            if r["of"] == "poisson":
                # What an independent implementation found for a field like this one.
                known = {("laplacian-mixed-soc", "2.5"): 1.2e-4, ("laplacian-mixed-soc", "3.5"): 2.3e-4,
                         ("laplacian-mixed-zoc", "2.5"): 9.5e-3, ("laplacian-mixed-zoc", "3.5"): 8.6e-3}
                error = known[(r["method"], r["support_ratio"])]
                self.assertAlmostEqual(float(r["error"]) / error, 1, delta=0.2)
            if r["of"] == "space":
                errors.setdefault((r["dimension"], r["walls"], r["jitter"], r["method"]), []).append(r)
        for (dimension, walls, jitter, method), curve in errors.items():
            if method == "laplacian-mixed-soc":
                # In 3D the coarse clouds are nearly all wall.
                low = 1.7 if dimension != "3" else 1.2
                self.assertTrue(low < float(curve[-1]["order"]) < 2.2, curve[-1])
                uncorrected = errors[dimension, walls, jitter, "laplacian-mixed-zoc"][-1]
                self.assertLess(float(curve[-1]["error"]), 0.8 * float(uncorrected["error"]))
            elif dimension == "1":
                self.assertLess(float(curve[-1]["order"]), 0.7)  # does not converge


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

    def test_eigenvalues_are_those_of_the_written_matrix(self):
        points = self.square(10)
        common = [points, "--scheme", "laplacian-direct-zoc", "--support", 0.3]
        self.run_program("assemble", *common, "-o", self.path("m.mtx"))
        values = np.linalg.eigvals(scipy.io.mmread(self.path("m.mtx")).toarray())
        self.run_program("inspect", *common, "--spectrum", "--report", self.path("r.json"))
        found = json.loads(self.path("r.json").read_text())["inspection"]["spectrum"]
        np.testing.assert_allclose([found["rightmost"], found["leftmost"]],
                                   [values.real.max(), values.real.min()], rtol=1e-9)


class Stability(ProgramTest):
    def test_the_quick_study(self):
        self.run_program("stability", "--dimension", 2, "--quick", "--out", self.path("s"))
        with open(self.path("s") / "stability.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(",".join(rows[0]),
                         "scheme,dimension,support_ratio,jitter,walls,seed,points,max_real,min_real,max_imag,"
                         "worst_rcond,worst_amplification,negative_share,error_l2,error_max,bound_max")
        self.assertEqual(len(rows), 17 * 3 * 2 * 3)
        for row in rows:
            self.assertTrue(all(np.isfinite(float(x)) for k, x in row.items() if k not in ("scheme", "walls")))
            self.assertLessEqual(float(row["error_max"]), float(row["bound_max"]))
            if row["scheme"] == "laplacian-positive":
                self.assertLess(float(row["max_real"]), 1e-10)
        for figure in ["stability_map_periodic", "stability_map_dirichlet", "stability_map_truncated", "spectra",
                       "history", "floor"]:
            self.assertGreater((self.path("s") / (figure + ".png")).stat().st_size, 5000)


class Tradeoff(ProgramTest):
    def test_the_quick_study(self):
        text = self.run_program("tradeoff", "--quick", "--out", self.path("t"))
        with open(self.path("t") / "tradeoff.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(",".join(rows[0]),
                         "scheme,dimension,kernel,support_ratio,arrangement,points,spacing,entries_per_row,error_l2,"
                         "error_max,solution_l2,solution_max,assemble_seconds,product_seconds,solve_seconds,"
                         "bytes_per_point,stable,weight,consistency")
        self.assertEqual(len(rows), 32 * 2 * 2 * 2)
        for row in rows:
            laplacian = row["scheme"].startswith("laplacian")
            self.assertEqual(row["stable"] in ("0", "1"), laplacian)
            self.assertLessEqual(float(row["error_l2"]), float(row["error_max"]))
            for seconds in ["assemble_seconds", "product_seconds"]:
                self.assertGreater(float(row[seconds]), 0)
        with open(self.path("t") / "tradeoff_front.csv") as file:
            front = list(csv.DictReader(file))
        # The front falls, and goes where no uncorrected scheme does.
        best = {}
        for row in front:
            key = row["derivative"], row["use"], row["arrangement"]
            self.assertLessEqual(float(row["error"]), best.get(key, 1e300))
            best[key] = float(row["error"])
        self.assertEqual(len(best), 10)
        for (derivative, use, arrangement), error in best.items():
            column = "solution_l2" if use == "solve" else "error_l2"
            uncorrected = min(float(r[column]) for r in rows if r["arrangement"] == arrangement and
                              r["scheme"].startswith(derivative) and r["consistency"] == "zoc")
            self.assertLess(error, uncorrected / 100)
        self.assertIn("twice the accuracy takes", text)
        for kind in ["gradient", "laplacian"]:
            self.assertGreater((self.path("t") / f"tradeoff_{kind}.png").stat().st_size, 20000)


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
        for tolerance in [0.2, 0.03]:
            text = self.run_program("advise", points, "--operator", "laplacian", "--use", "implicit", "--fixed", "edge",
                                    "--tolerance", tolerance, "--wavelength", 0.8)
            best = (np.inf, None)
            for scheme, ratio in self.candidates(points, "laplacian", 2):
                (m,), _ = self.matrices(points, scheme, ratio)
                counts = np.diff(m.indptr)[rows]
                inner = m.toarray()[np.ix_(rows, rows)]
                if self.error([m], t["x"], t["y"], rows, 0.8) > tolerance or (counts == 1).any():
                    continue
                if np.linalg.eigvals(inner).real.max() > 1e-3 * np.median(-np.diag(inner)):
                    continue
                best = min(best, (counts.mean(), f"{scheme} with --support-ratio {ratio:g}"))
            self.assertIn(f"Take {best[1]}: ", text)
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


class Spmv(ProgramTest):
    def test_a_matrix_of_its_own_and_one_of_scipy(self):
        self.run_program("assemble", self.square(20), "--scheme", "laplacian-mixed-zoc", "--volume", 0.0025, "--support", 0.2,
                         "-o", self.path("m.mtx"))
        text = self.run_program("spmv", self.path("m.mtx"), "--threads", 1)
        self.assertIn("400 x 400", text)
        self.assertRegex(text, r"reading that many bytes \(roof\) .* 100%")
        for line in ["Eigen, row-major", "Eigen, column-major", "gradpsi, values in single precision",
                     "gradpsi, four vectors, each"]:
            self.assertRegex(text, re.escape(line) + r".* [0-9.]+ +[0-9.]+ +[0-9]+%")
        self.assertLess(float(text.split()[-1]), 1e-14)
        scipy.io.mmwrite(self.path("s.mtx"), scipy.sparse.random(50, 30, 0.2, random_state=1) )
        self.assertIn("50 x 30, 300 entries", self.run_program("spmv", self.path("s.mtx")))
        symmetric = scipy.sparse.random(40, 40, 0.2, random_state=2)
        scipy.io.mmwrite(self.path("u.mtx"), symmetric + symmetric.T, symmetry="symmetric")
        text = self.run_program("spmv", self.path("u.mtx"))
        self.assertIn("symmetric", text)
        self.assertIn("gradpsi, upper triangle only", text)

    def test_a_file_that_is_no_matrix(self):
        self.assertIn("expected '%%MatrixMarket", self.run_program("spmv", self.square(4), expect=1))
        self.path("empty.mtx").write_text("%%MatrixMarket matrix coordinate real general\n2 2 0\n")
        self.assertIn("has no entries", self.run_program("spmv", self.path("empty.mtx"), expect=1))


class Errors(ProgramTest):
    def test_bad_usage_is_2_and_shows_the_usage(self):
        points = self.square()
        assemble = ["assemble", points, "--scheme", "laplacian-mixed-soc", "-o", self.path("l.mtx")]
        for arguments in [[], ["nonsense"], ["assemble"], ["assemble", points], ["schemes", "extra"],
                          [*assemble, "--support", "wide"],
                          [*assemble, "--support", 1, "--support-ratio", 2],
                          [*assemble, "--support", 1, "--on-degenerate", "hope"],
                          [*assemble, "--support", 1, "--threads", "two"],
                          [*assemble, "--support", 1, "--threads", -1],
                          [*assemble, "--support", 0.3, "--periodic", "1,,1"],
                          [*assemble, "--support", 0.3, "--periodic", "1,1,1,1"],
                          ["assemble", points, "--scheme", "gradient-direct-foc", "--support", 0.3,
                           "-o", self.path("g.txt")],
                          ["derive", points, "--field", "u", "--scheme", "gradient-direct-foc",
                           "--support", 1, "-o", self.path("u.txt")],
                          ["converge", "--dimension", 4]]:
            self.assertIn("Usage: gradpsi", self.run_program(*arguments, expect=2))
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv"])

    def test_bad_data_is_1_and_leaves_nothing(self):
        points = self.square(u=lambda x, y: np.where(x < 0.1, np.nan, x))
        def assemble(*more, scheme="laplacian-mixed-soc"):
            return self.run_program("assemble", points, "--scheme", scheme, "-o", self.path("l.mtx"), *more,
                                    expect=1)
        self.assertIn("valid: laplacian-mixed-soc, ", assemble("--support", 1, scheme="laplacian-mixed-sco"))
        self.assertIn("valid: wendland-c2, ", assemble("--support", 1, "--kernel", "wendland"))
        self.assertIn("support must be > 0", assemble("--support", -0.3))
        self.assertIn("support must be > 0", assemble("--support", "nan"))
        self.assertIn("--support-ratio must be > 0", assemble("--support-ratio", 0))
        self.assertIn("--volume must be > 0", assemble("--support", 1, "--volume", -1))
        self.assertIn("have no neighbour within the support 1e-09", assemble("--support", 1e-9))
        self.assertIn("no column 'support': give --support", assemble())
        self.assertIn("more than half the periodic box", assemble("--support", 0.6, "--periodic", "1,1"))
        self.assertIn("box length -1 must be", assemble("--support", 0.3, "--periodic", "-1,1"))
        def derive(field):
            return self.run_program("derive", points, "--field", field, "--scheme", "gradient-direct-foc",
                                    "--support", 0.3, "-o", self.path("g.csv"), expect=1)
        self.assertIn("unknown column 'v'; valid: ", derive("v"))
        self.assertIn("has a value of 'u' that is not finite", derive("u"))
        points = self.path("none.csv")
        self.assertIn("cannot read", assemble("--support", 1))
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv"])

    def test_an_unknown_subcommand_names_the_valid_ones(self):
        self.assertIn("unknown subcommand 'asemble'; valid: schemes assemble derive diffuse inspect converge stability tradeoff advise spmv",
                      self.run_program("asemble", expect=2))

    def test_the_points_are_not_overwritten(self):
        points = self.square(u=lambda x, y: x)
        before = points.read_text()
        bare = ["--scheme", "gradient-direct-foc", "--support", 0.3]
        mtx = self.folder / "p_x.mtx"
        mtx.write_text(before)
        for arguments in [["derive", points, *bare, "--field", "u", "-o", points],
                          ["assemble", points, *bare, "-o", self.path("l.mtx"), "--report", points],
                          ["assemble", mtx, *bare, "-o", self.path("p.mtx")]]:
            self.assertIn("it is not overwritten", self.run_program(*arguments, expect=1))
        self.assertIn("are both to be written to",
                      self.run_program("assemble", points, *bare, "-o", self.path("l.mtx"),
                                       "--report", self.path("l_y.mtx"), expect=1))
        self.assertEqual(points.read_text(), before)
        self.assertEqual(mtx.read_text(), before)

    def test_standard_output_takes_a_matrix_and_nothing_else(self):
        arguments = ["assemble", self.square(), "--scheme", "laplacian-mixed-soc", "--support", "0.3", "-o"]
        self.run_program(*arguments, self.path("l.mtx"))
        expected = self.path("l.mtx").read_text()
        self.assertEqual(self.run_program(*arguments, "/dev/stdout"), expected)
        link = self.path("link")
        link.symlink_to("/proc/self/fd/1")
        with open(self.path("out"), "w") as out:
            subprocess.run([PROGRAM, *map(str, arguments), link], stdout=out, check=True)
        self.assertTrue(link.is_symlink())
        self.assertEqual(self.path("out").read_text(), expected)

    def test_a_file_that_cannot_be_written_is_1(self):
        points = self.square()
        bare = ["assemble", points, "--scheme", "laplacian-mixed-soc", "--support", 0.3, "-o"]
        for out in [self.path("no/l.mtx"), "/dev/full"]:
            self.assertIn("cannot write", self.run_program(*bare, out, expect=1))
        # A pipe that closes early, as `| head -1` does.
        done = subprocess.run(["bash", "-c", '"$0" "$@" | head -c 10; exit ${PIPESTATUS[0]}',
                               PROGRAM, *map(str, bare), "/dev/stdout"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("cannot write /dev/stdout: Broken pipe", done.stderr.replace("\n", " ") + ":")


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

    def test_the_table_is_whole(self):
        here = Path(__file__).parent
        exist = {f"{suite}.{name}" for source in here.glob("*.cpp")
                 for suite, name in re.findall(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", source.read_text(), re.M)}
        for node in ast.parse(Path(__file__).read_text()).body:
            if isinstance(node, ast.ClassDef):
                exist |= {f"{node.name}.{f.name}" for f in node.body if isinstance(f, ast.FunctionDef)}
        named = {}
        for number, tests in re.findall(r"^\| (\d+) \|.*\|(.*)\|$", (here / "README.md").read_text(), re.M):
            named[int(number)] = set(re.findall(r"`(\w+\.\w+)`", tests))
        self.assertEqual(list(named), list(range(1, 30)))
        for number, tests in named.items():
            self.assertEqual(tests - exist, set(), "are in the table only")
            numbered = {t for t in exist if re.match(rf"Fault{number:02}(?!\d)|Faults\.test_{number:02}_", t)}
            self.assertTrue(numbered, f"nothing is named after {number}")
            self.assertEqual(numbered - tests, set(), f"are not in line {number}")


class Writers(ProgramTest):
    """Disks that are full, pipes that close early, folders and names that cannot be written: exit code 1, an
    error that names the file, the old files whole, nothing beside them."""

    def setUp(self):
        super().setUp()
        self.points = self.square(n=8, u=lambda x, y: x * y, edge=lambda x, y: (x < 0.15) | (x > 0.85))
        bare = ["--support", 0.4, "--scheme"]
        diffuse = ["diffuse", self.points, "--field", "u", "--fixed", "edge", *bare, "laplacian-mixed-zoc"]
        out = self.path
        self.file_writers = [  # files, command
            (["l.mtx"], ["assemble", self.points, *bare, "laplacian-mixed-soc", "-o", out("l.mtx")]),
            (["g_x.mtx", "g_y.mtx"], ["assemble", self.points, *bare, "gradient-direct-foc", "-o", out("g.mtx")]),
            (["r.json"], ["assemble", self.points, *bare, "laplacian-mixed-soc", "-o", "/dev/null",
                          "--report", out("r.json")]),
            (["d.csv"], ["derive", self.points, "--field", "u", *bare, "gradient-direct-foc", "-o", out("d.csv")]),
            (["d.vtu"], ["derive", self.points, "--field", "u", *bare, "gradient-direct-foc", "-o", out("d.vtu")]),
            (["i.csv"], ["inspect", self.points, *bare, "laplacian-mixed-soc", "-o", out("i.csv")]),
            (["i.vtu"], ["inspect", self.points, *bare, "laplacian-mixed-soc", "-o", out("i.vtu")]),
            (["t.csv"], [*diffuse, "--steady", "-o", out("t.csv")]),
            (["t.vtu"], [*diffuse, "--steady", "-o", out("t.vtu")]),
            (["s_0.vtu"], [*diffuse, "--time-step", 0.1, "--steps", 2, "--every", 1, "-o", out("s.vtu")]),
        ]
        self.studies = [
            ("convergence.csv", ["converge", "--points-max", 40]),
            ("stability_1d.csv", ["stability", "--quick", "--dimension", 1]),
            ("tradeoff_1d.csv", ["tradeoff", "--quick", "--dimension", 1]),
        ]

    def snapshot(self):
        return {p: p.read_bytes() for p in self.folder.rglob("*") if p.is_file()}

    def fails(self, command, *names, **how):
        """Runs what must end with exit code 1, an error that has one of these names in it, and all files as
        they were."""
        before = self.snapshot()
        how = {"stdout": subprocess.DEVNULL, **how}
        done = subprocess.run([PROGRAM, *map(str, command)], stderr=subprocess.PIPE, text=True, **how)
        self.assertEqual(done.returncode, 1, (command, done.stderr))
        self.assertTrue(done.stderr.startswith("error: "), done.stderr)
        self.assertTrue(any(str(name) in done.stderr for name in names), (names, done.stderr))
        self.assertEqual(self.snapshot(), before)
        return done.stderr

    @staticmethod
    def file_limit(size):
        """A disk on which no file grows beyond that."""
        return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))}

    def test_full_disk(self):
        for files, command in self.file_writers:
            for file in files:
                self.path(file).write_text("the old one")
            text = self.fails(command, self.path(files[0]), **self.file_limit(100))
            self.assertIn("cannot write", text)
            for file in files:
                self.path(file).unlink()
            self.fails(command, self.path(files[0]), **self.file_limit(100))  # none is there

    def test_full_device(self):
        for files, command in self.file_writers:
            for file in files:
                self.path(file).symlink_to("/dev/full")
                self.assertIn("No space left", self.fails(command, "/dev/full", self.path(file)))
                self.path(file).unlink()

    def test_a_folder_in_the_way(self):
        for files, command in [*self.file_writers, (["s.pvd"], self.file_writers[-1][1]),
                               (["t.png"], self.file_writers[-2][1])]:
            for file in files:
                self.path(file).mkdir()
                self.fails(command, self.path(file))
                self.path(file).rmdir()
                for left in self.folder.glob("s*.vtu"):
                    left.unlink()

    def test_a_folder_that_cannot_be_written(self):
        how = {"user": 65534} if os.geteuid() == 0 else {}
        self.folder.chmod(0o555)
        self.addCleanup(self.folder.chmod, 0o700)
        try:
            subprocess.run([PROGRAM, "schemes"], check=True, stdout=subprocess.DEVNULL, **how)
        except (PermissionError, subprocess.CalledProcessError):
            self.skipTest("another user cannot run the program")
        for files, command in self.file_writers:
            self.assertIn("Permission denied", self.fails(command, self.path(files[0]), **how))
        for _, command in self.studies:
            self.fails([*command, "--out", self.path("new")], self.path("new"), **how)

    def test_a_picture_that_does_not_fit_leaves_the_old_one(self):
        self.path("t.png").write_text("the old one")
        command = next(command for files, command in self.file_writers if files == ["t.csv"])
        done = subprocess.run([PROGRAM, *map(str, command)], capture_output=True, text=True,
                              **self.file_limit(8000))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("no picture", done.stdout)
        self.assertEqual(self.path("t.png").read_text(), "the old one")
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv", "t.csv", "t.png"])

    def test_studies(self):
        out = self.path("out")
        for table, command in self.studies:
            self.fails([*command, "--out", self.points], self.points)
            out.mkdir(exist_ok=True)
            (out / table).write_text("the old one")
            self.fails([*command, "--out", out], out / table, **self.file_limit(100))

    def test_figures_that_do_not_fit_leave_the_old_ones(self):
        out = self.path("out")
        command = ["converge", "--points-max", 40, "--out", out]
        self.run_program(*command)
        os.truncate(out / "figure1.png", 3)
        size = max(p.stat().st_size for p in out.glob("convergence*"))
        self.fails(command, "figure", **self.file_limit(size + 100))

    def test_standard_output(self):
        matrix = self.path("l.mtx")
        self.run_program(*self.file_writers[0][1])
        for command in [["schemes"], ["schemes", "--json"], ["spmv", matrix],
                        ["advise", self.points, "--operator", "gradient", "--tolerance", 0.5, "--wavelength", 1],
                        ["inspect", self.points, "--scheme", "laplacian-mixed-soc", "--support", 0.4],
                        [*self.file_writers[0][1][:-1], "/dev/stdout"]]:
            reader, writer = os.pipe()
            os.close(reader)
            with os.fdopen(writer, "w") as closed, open("/dev/full", "w") as full:
                for out in [closed, full]:
                    self.assertIn("cannot write", self.fails(command, "standard output", "/dev/stdout", stdout=out))

    def test_standard_output_of_those_who_write_files(self):
        """Their files are whole then, and the failure still shows."""
        for files, command in [*self.file_writers, *[([f"out/{table}"], [*command, "--out", self.path("out")])
                                                     for table, command in self.studies[:1]]]:
            with open("/dev/full", "w") as full:
                done = subprocess.run([PROGRAM, *map(str, command)], stdout=full, stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 1, command)
            self.assertEqual(done.stderr, "error: cannot write to standard output\n")
            for file in files:
                self.assertGreater(self.path(file).stat().st_size, 100)
        self.assertEqual([p for p in self.folder.rglob("*") if "part" in p.name], [])

    def test_nothing_remains_of_a_program_that_is_killed(self):
        try:
            os.close(os.open(self.folder, os.O_TMPFILE | os.O_WRONLY))
        except OSError:
            self.skipTest("this file system has no files without a name")
        big = self.square(n=150)
        out = self.path("big.mtx")
        out.write_text("the old one")
        before = self.snapshot()
        command = [PROGRAM, "assemble", big, "--scheme", "laplacian-mixed-soc", "--support-ratio", "4", "-o", out]
        for signal_number in [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]:
            with subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL) as program:
                fds = Path(f"/proc/{program.pid}/fd")
                def is_writing():
                    try:
                        return any(str(self.folder) in os.readlink(fd) and str(fd.readlink()) != str(big)
                                   for fd in fds.iterdir())
                    except OSError:
                        return False
                while program.poll() is None and not is_writing():
                    pass
                program.send_signal(signal_number)
            self.assertEqual(program.returncode, -signal_number)
            self.assertEqual(self.snapshot(), before)


class Converge(ProgramTest):
    def test_one_dimension(self):
        text = self.run_program("converge", "--out", self.path("out"), "--points-max", 2000)
        for claim in ["zoc, first, regular: no convergence", "zoc, first, irregular: no convergence",
                      "zoc, second, regular: no convergence", "foc, first, regular: order between 1 and 2",
                      "foc, first, irregular: order between 1 and 2", "soc, first, regular: order 2",
                      "soc, first, irregular: order 2", "soc, second, regular: order 2",
                      "soc, second, irregular: order 1"]:
            self.assertRegex(text, claim + r" .*  yes \(")
        self.assertRegex(text, r"the error grows .* partly \(9 of 12 curves; exceptions: diffuse-ns\)")
        with open(self.path("out/convergence.csv")) as file:
            rows = list(csv.reader(file))
        self.assertEqual(",".join(rows[0]),
                         "scheme,arrangement,support_ratio,points,spacing,error_l2,error_max,order")
        self.assertEqual(len(rows) - 1, 17 * 2 * 3 * 7)
        orders = {}
        for scheme, arrangement, ratio, points, spacing, _, _, order in rows[1:]:
            self.assertAlmostEqual(float(spacing), 2 / int(points))
            self.assertEqual(order == "", points == "20")
            orders.setdefault((scheme, arrangement, ratio), []).append(order)
        self.assertAlmostEqual(float(orders["gradient-direct-foc", "regular", "2.5"][-1]), 1.5, delta=0.05)
        self.assertAlmostEqual(float(orders["gradient-direct-soc", "irregular", "3.5"][-1]), 2, delta=0.1)
        self.assertAlmostEqual(float(orders["laplacian-mixed-zoc", "irregular", "2.5"][-1]), -1, delta=0.2)
        for name in ["figure1.svg", "figure1.png", "figure2.svg", "figure2.png"]:
            self.assertGreater(self.path("out/" + name).stat().st_size, 10_000)

    def test_more_dimensions(self):
        for dimension, most in [(2, 3249), (3, 8000)]:
            self.run_program("converge", "--dimension", dimension, "--out", self.path("out"),
                             "--points-max", most)
            with open(self.path(f"out/convergence_{dimension}d.csv")) as file:
                rows = list(csv.DictReader(file))
            self.assertEqual(int(rows[-1]["points"]), most)
            orders = [float(r["interior_order"]) for r in rows
                      if r["scheme"] == "gradient-diffuse-soc" and r["interior_order"]]
            self.assertTrue(orders)
            for order in orders:
                self.assertAlmostEqual(order, 2, delta=0.4)
            self.assertTrue(self.path(f"out/figure2_{dimension}d.png").exists())

    def test_the_study_is_reproducible(self):
        tables = []
        for threads in [1, 2]:
            self.run_program("converge", "--points-max", 4000, "--out", self.path("out"),
                             "--threads", threads)
            tables.append(self.path("out/convergence.csv").read_text())
        self.assertEqual(tables[0], tables[1])


if __name__ == "__main__":
    unittest.main(argv=sys.argv)
