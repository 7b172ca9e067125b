"""gradpsi stability."""

import csv
import unittest

import numpy as np

from program import LONG, ProgramTest

DIMENSION, SUFFIX = (2, "") if LONG else (1, "_1d")


class Stability(ProgramTest):
    def test_the_quick_study(self):
        self.run_program("stability", "--dimension", DIMENSION, "--quick", "--out", self.path("s"))
        with open(self.path("s") / f"stability{SUFFIX}.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(",".join(rows[0]),
                         "scheme,dimension,support_ratio,jitter,walls,seed,points,max_real,min_real,max_imag,"
                         "worst_rcond,worst_amplification,negative_share,error_l2,error_max,bound_max")
        self.assertEqual(len(rows), 29 * 3 * 2 * 3)
        for row in rows:
            self.assertTrue(all(np.isfinite(float(x)) for k, x in row.items() if k not in ("scheme", "walls")))
            self.assertLessEqual(float(row["error_max"]), float(row["bound_max"]))
            if row["scheme"] == "laplacian-positive":
                self.assertLess(float(row["max_real"]), 1e-10)
        with open(self.path("s") / f"forecast{SUFFIX}.csv") as file:
            told = list(csv.DictReader(file))
        self.assertEqual(len({row["points"] for row in told}), 8 if LONG else 5)
        self.assertEqual(len(told), 29 * (2 * (2 * 5 + 3 * 3) if LONG else 26))
        grows = np.array([float(row["rate"]) > float(row["zero"]) for row in told])
        foretold = np.array([row["foretold"] == "1" for row in told])
        certain = np.array([row["certain"] == "1" for row in told])
        self.assertGreater(grows.sum(), len(told) / 4)
        self.assertLess((grows & ~foretold).sum(), 1 if LONG else 0.01 * len(told))
        self.assertLess((~grows & foretold).sum(), 0.02 * len(told))
        self.assertTrue((grows == foretold)[certain].all())
        figures = [f"stability_map_{walls}{SUFFIX}" for walls in ("periodic", "dirichlet", "truncated")]
        for figure in figures + (["spectra", "history", "floor"] if LONG else []):
            self.assertGreater((self.path("s") / (figure + ".png")).stat().st_size, 5000)


if __name__ == "__main__":
    unittest.main()
