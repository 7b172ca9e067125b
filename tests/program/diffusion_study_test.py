"""The study of diffusion."""

import csv
import os
import subprocess
import unittest


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


if __name__ == "__main__":
    unittest.main()
