"""gradpsi tradeoff."""

import csv
import unittest

from program import LONG, ProgramTest

DIMENSION, SUFFIX = (2, "") if LONG else (1, "_1d")


class Tradeoff(ProgramTest):
    def test_the_quick_study(self):
        text = self.run_program("tradeoff", "--dimension", DIMENSION, "--quick", "--out", self.path("t"))
        with open(self.path("t") / f"tradeoff{SUFFIX}.csv") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(",".join(rows[0]),
                         "scheme,dimension,kernel,support_ratio,arrangement,points,spacing,entries_per_row,error_l2,"
                         "error_max,solution_l2,solution_max,assemble_seconds,product_seconds,solve_seconds,"
                         "bytes_per_point,stable,weight,consistency,tolerance")
        self.assertEqual(len(rows), (56 * 2 + 2) * 2 * 2)
        # Rows chosen to 1 % are good to it on the field, a product of waves, where all can be.
        for row in rows:
            if row["weight"] == "chosen" and float(row["points"]) >= 160:
                self.assertEqual(row["tolerance"], "1e-02")
                self.assertLess(float(row["error_max"]), 0.02)
        for row in rows:
            laplacian = row["scheme"].startswith("laplacian")
            self.assertEqual(row["stable"] in ("0", "1"), laplacian)
            self.assertLessEqual(float(row["error_l2"]), float(row["error_max"]))
            for seconds in ["assemble_seconds", "product_seconds"]:
                self.assertGreater(float(row[seconds]), 0)
        with open(self.path("t") / f"tradeoff_front{SUFFIX}.csv") as file:
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
            self.assertGreater((self.path("t") / f"tradeoff_{kind}{SUFFIX}.png").stat().st_size, 20000)

    def test_graded_points_with_supports_by_their_local_spacing(self):
        self.run_program("tradeoff", "--quick", "--dimension", 1, "--grading", 10, "--out", self.path("t"))
        with open(self.path("t") / "tradeoff_1d_graded.csv") as file:
            rows = [r for r in csv.DictReader(file) if r["support_ratio"] == "3.5" and r["points"] == "160"]
        # With one support for all, some points would see no other one, and the rest ten times as many.
        for row in rows:
            self.assertLess(float(row["entries_per_row"]), 20 if row["scheme"] == "laplacian-kgf" else 12)
        errors = {(r["scheme"], r["arrangement"]): float(r["error_l2"]) for r in rows}
        for arrangement in ["regular", "irregular"]:
            self.assertLess(errors["laplacian-ls-4", arrangement], 1e-5)
            self.assertLess(errors["gradient-direct-soc", arrangement], 1e-3)
        error = self.run_program("tradeoff", "--grading", 0.5, "--out", self.path("t"), expect=1)
        self.assertIn("grading must be >= 1", error)


if __name__ == "__main__":
    unittest.main()
