"""How many threads the program starts."""

import os
import re
import subprocess
import unittest

from program import PROGRAM, ProgramTest

COUNTER = os.environ.get("GRADPSI_COUNT_THREADS")  # see count_threads.cpp


@unittest.skipUnless(COUNTER, "sanitizers have threads of their own")
class Threads(ProgramTest):
    def started(self, *command):
        """The threads that a command starts, OpenMP's, OpenBLAS's and others."""
        log = self.path("started")
        log.write_bytes(b"")
        done = subprocess.run([PROGRAM, *map(str, command)], capture_output=True, text=True, cwd=self.folder,
                              env={**os.environ, "LD_PRELOAD": COUNTER, "GRADPSI_STARTED": str(log), "OMP_NUM_THREADS": "4"})
        self.assertEqual(done.returncode, 0, done.stderr)
        return log.stat().st_size

    def commands(self):
        probes = self.write_points({"x": [0.5] * 3000, "y": [0.5] * 3000}, "probes.csv")
        fewest = self.square(14).rename(self.path("fewest.csv"))
        few = self.square(24).rename(self.path("few.csv"))  # all of whose eigenvalues are computed
        points = self.square(80, u=lambda x, y: x * y)
        usual = [points, "--scheme", "laplacian-mixed-zoc", "--support-ratio", 2.5]
        step = [*usual, "--field", "u", "--time-step", 1e-3, "--steps", 1, "-o", "u.csv", "--method"]
        return [
            ["assemble", *usual, "-o", "m.mtx"],  # which spmv reads
            ["derive", *usual, "--field", "u", "-o", "d.csv"],
            ["derive", points, "--scheme", "value-mls-2", "--field", "u", "--at", probes, "-o", "d.csv"],
            *(["diffuse", *step, method] for method in ("cholesky", "lu", "krylov")),
            ["inspect", *usual, "--spectrum"],
            ["inspect", few, "--scheme", "laplacian-mixed-zoc", "--support-ratio", 2.5, "--spectrum"],
            ["converge", "--quick"],
            ["stability", "--quick", "--dimension", 1],
            ["tradeoff", "--quick", "--dimension", 1],
            ["advise", fewest, "--operator", "laplacian", "--tolerance", 0.1, "--use", "implicit"],
            ["spmv", "m.mtx"],
        ]

    def test_42_one_thread_starts_no_second_one(self):
        commands = self.commands()
        listed = re.findall(r"^  (\w+)  ", self.run_program("--help").split("Subcommands:\n")[1], re.M)
        self.assertEqual({c for c in listed if "--threads" in self.run_program(c, "--help")}, {c[0] for c in commands})
        loaded = self.started("schemes")  # OpenBLAS has its own before main(), which sends them home
        for command in commands:
            with self.subTest(" ".join(map(str, command))):
                self.assertEqual(self.started(*command, "--threads", 1), loaded)
                # It is one that starts threads, and they are seen. Studies take longest, and are made of the same.
                if command[0] not in ("converge", "stability", "tradeoff"):
                    self.assertGreater(self.started(*command, "--threads", 3), loaded)


if __name__ == "__main__":
    unittest.main()
