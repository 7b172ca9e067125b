"""What is wrong on the command line or in the data."""

import os
import subprocess
import unittest

import numpy as np

from program import PROGRAM, ProgramTest


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


if __name__ == "__main__":
    unittest.main()
