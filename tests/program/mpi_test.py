"""gradpsi-mpi."""

import json
import os
import re
import subprocess
import unittest
import xml.etree.ElementTree

import meshio
import numpy as np

from program import LONG, DiffusionScene

PROCESSES = [1, 2, 4] if LONG else [3]


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

    def same_as_one(self, *arguments, processes=PROCESSES, tolerance=1e-9):
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
                             ("laplacian-mixed-soc", ["--time-step", 2e-5, "--steps", 3, "--theta", 0.5]),
                             ("laplacian-mixed-zoc", ["--steady"])]:
            text = self.same_as_one(self.points, "--scheme", scheme, "--support", 0.15, "--fixed", "wall",
                                    "--normal", "n", "--flux", "flux", "--source", "f", "--conductivity", "kappa",
                                    "--mean", "harmonic", *more, tolerance=1e-7)
            self.assertIn(f"PETSc, {max(PROCESSES)} processes", text)
            self.assertIn("picture: ", text)

    def test_exchange_at_walls(self):
        points = self.write_points({**self.table, "c": 2 * self.table["nx"]}, "exchange.csv")
        for more in [["--steady"], ["--steady", "--gradient", "gradient-direct-foc"],
                     ["--time-step", 2e-3, "--steps", 3, "--theta", 0.5, "--damped-start"]]:
            self.same_as_one(points, "--scheme", "laplacian-mixed-zoc", "--support", 0.15, "--normal", "n", "--flux", "flux",
                             "--transfer", "c", "--conductivity", "kappa", *more, processes=[3], tolerance=1e-7)

    def test_widened_rows_and_number_densities(self):
        self.same_as_one(self.points, "--scheme", "laplacian-mixed-soc", "--support-ratio", 2, "--on-degenerate", "widen",
                         "--fixed", "wall", "--time-step", 1e-3, "--steps", 2, tolerance=1e-8)
        self.same_as_one(self.points, "--scheme", "laplacian-ls-2", "--fixed", "wall", "--time-step", 1e-3, "--steps", 2,
                         tolerance=1e-8)
        error = self.run_mpi(2, "diffuse", self.points, "--field", "T", "--scheme", "laplacian-positive", "--fixed", "wall",
                             "--time-step", 1e-3, "--steps", 2, "-o", self.path("o.csv"), expect=1)
        self.assertRegex(error, r"could not be computed at point \d+, which has no condition either")

    def test_a_periodic_box_supports_and_duplicates(self):
        t = self.table
        columns = {name: np.concatenate([t[name], t[name][5:300:70]]) for name in ["x", "y", "T"]}
        columns["support"] = np.linspace(0.14, 0.17, len(t["x"]))
        columns["support"] = np.concatenate([columns["support"], columns["support"][5:300:70]])
        points = self.write_points(columns, "twice.csv")
        self.same_as_one(points, "--scheme", "laplacian-mixed-zoc", "--periodic", "1,1", "--duplicates", "drop",
                         "--volume", 0.0025, "--time-step", 1e-3, "--steps", 2)
        for processes in [1, 3]:
            error = self.run_mpi(processes, "diffuse", points, "--field", "T", "--scheme", "laplacian-mixed-zoc",
                                 "--time-step", 1, "--steps", 1, "-o", self.path("o.csv"), expect=1)
            self.assertRegex(error, r"points 5 and 400 coincide at \(.*\); 5 of 405 points coincide with an earlier one")

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
        growing = ["diffuse", self.points, "--field", "T", "--scheme", "laplacian-mixed-soc", "--support", 0.15, "--fixed", "wall",
                   "--time-step", 0.01, "--steps", 50, "-o", self.path("o.csv")]
        of_one = self.run_program(*growing, expect=1).split(":")[:3]
        self.assertEqual(self.run_mpi(3, *growing, expect=1).split(":")[:2], of_one[:2])  # the step; values differ by rounding
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


if __name__ == "__main__":
    unittest.main()
