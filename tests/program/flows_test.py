"""Flows by programs that use the library, at small size."""

import csv
import os
import subprocess
import unittest
from pathlib import Path

FLOWS = Path(os.environ["GRADPSI_FLOWS"])


def rows(program, *arguments):
    # The systems are small: more threads would wait for one another.
    done = subprocess.run([FLOWS / program, *map(str, arguments)], capture_output=True, text=True, check=True,
                          env=os.environ | {"OMP_NUM_THREADS": "1"})
    return list(csv.DictReader(done.stdout.splitlines()))


class TaylorGreen(unittest.TestCase):
    def test_the_error_on_moving_points_falls_with_order_2(self):
        for jitter in [0.2, 0]:
            coarse, fine = rows("taylor_green", "--jitter", jitter, 20, 40)
            self.assertLess(float(fine["error"]), 2e-3)
            self.assertGreater(float(fine["order"]), 2)
            self.assertEqual(coarse["order"], "")

    def test_what_is_no_number_is_an_error(self):
        for program, words, message in [
                ("taylor_green", ["many"], "POINTS_PER_SIDE must be a whole number of at least 9, not 'many'"),
                ("taylor_green", ["20", "--jitter", "-1"], "--jitter must be a number of at least 0, not '-1'"),
                ("cavity", ["33x"], "POINTS_PER_SIDE must be a whole number of at least 9, not '33x'"),
                ("cavity", ["8"], "POINTS_PER_SIDE must be a whole number of at least 9, not '8'")]:
            done = subprocess.run([FLOWS / program, *words], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (1, f"error: {message}\n"))


class Cavity(unittest.TestCase):
    def test_it_has_the_published_velocities(self):
        profile = rows("cavity", 33)
        published = [r for r in profile if r["published"]]
        self.assertEqual(len(published), 34)
        self.assertLess(max(abs(float(r["computed"]) - float(r["published"])) for r in published), 0.025)


if __name__ == "__main__":
    unittest.main()
