"""gradpsi spmv."""

import re
import unittest

import scipy.io
import scipy.sparse

from program import ProgramTest


class Spmv(ProgramTest):
    def test_a_matrix_of_its_own_and_one_of_scipy(self):
        self.run_program("assemble", self.square(20), "--scheme", "laplacian-mixed-zoc", "--volume", 0.0025, "--support", 0.2,
                         "-o", self.path("m.mtx"))
        text = self.run_program("spmv", self.path("m.mtx"), "--threads", 1)
        self.assertIn("400 x 400", text)
        self.assertRegex(text, r"reading that many bytes \(roof\) .* 100%")
        for line in ["Eigen, row-major", "Eigen, column-major", "gradpsi, values in single precision",
                     "gradpsi, four vectors, each"]:
            self.assertRegex(text, re.escape(line) + r".* [0-9.]+ +[0-9.]+( +[0-9]+%| *)\n")
        shares = [int(share) for share in re.findall(r" (\d+)%\n", text)]
        self.assertLessEqual(max(shares), 100)
        self.assertEqual("Without a share: faster than the roof" in text, len(shares) < text.count("\ngradpsi") + text.count("\nEigen") + 2)
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


if __name__ == "__main__":
    unittest.main()
