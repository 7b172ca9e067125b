"""gradpsi converge."""

import csv
import unittest

from program import ProgramTest


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
    unittest.main()
