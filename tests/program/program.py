"""The program as scripts see it: options, files, exit codes. What its tests share; CTest runs each file by itself."""

import csv
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

PROGRAM = os.environ["GRADPSI_PROGRAM"]
LONG = "GRADPSI_LONG" in os.environ  # what tests/run.sh leaves to --all
ROOT = Path(__file__).parent.parent.parent


def without_times(said):
    """What stands on standard error but for the warning that the machine was busy, which tests may well have made it."""
    return re.sub(r"^warning: of \d+ times [^\n]*\n", "", said, flags=re.M)


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def path(self, name):
        return self.folder / name

    def run_program(self, *arguments, expect=0, warning=None):
        """What it prints, or the error; `warning` is what it must say on a line of standard error."""
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
        self.assertEqual(done.returncode, expect, done.stderr)
        said = without_times(done.stderr)
        if warning is not None:
            first, said = said.split("\n", 1)
            self.assertTrue(first.startswith("warning: "), done.stderr)
            self.assertIn(warning, first)
        if expect == 0:
            self.assertEqual(said, "")  # no progress bar away from a terminal
        else:
            self.assertTrue(said.startswith("error: "), done.stderr)
        return done.stdout if expect == 0 else said

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


class DiffusionScene(ProgramTest):
    def setUp(self):
        super().setUp()
        self.points = self.square(
            20, T=lambda x, y: np.sin(3 * x) + np.cos(5 * y), wall=lambda x, y: x < 0.05,
            nx=lambda x, y: x > 0.95, ny=lambda x, y: 0 * x, flux=lambda x, y: y,
            f=lambda x, y: x * y, kappa=lambda x, y: np.exp(x - y))
        self.table = self.read_csv("points.csv")
