"""Files that cannot be written."""

import os
import resource
import signal
import subprocess
import unittest
from pathlib import Path

from program import PROGRAM, ProgramTest, without_times


class Writers(ProgramTest):
    """Disks that are full, pipes that close early, folders and names that cannot be written: exit code 1, an
    error that names the file, the old files whole, nothing beside them."""

    def setUp(self):
        super().setUp()
        self.points = self.square(n=8, u=lambda x, y: x * y, edge=lambda x, y: (x < 0.15) | (x > 0.85))
        bare = ["--support", 0.4, "--scheme"]
        diffuse = ["diffuse", self.points, "--field", "u", "--fixed", "edge", *bare, "laplacian-mixed-zoc"]
        out = self.path
        self.file_writers = [  # files, command
            (["l.mtx"], ["assemble", self.points, *bare, "laplacian-mixed-soc", "-o", out("l.mtx")]),
            (["g_x.mtx", "g_y.mtx"], ["assemble", self.points, *bare, "gradient-direct-foc", "-o", out("g.mtx")]),
            (["r.json"], ["assemble", self.points, *bare, "laplacian-mixed-soc", "-o", "/dev/null",
                          "--report", out("r.json")]),
            (["d.csv"], ["derive", self.points, "--field", "u", *bare, "gradient-direct-foc", "-o", out("d.csv")]),
            (["d.vtu"], ["derive", self.points, "--field", "u", *bare, "gradient-direct-foc", "-o", out("d.vtu")]),
            (["i.csv"], ["inspect", self.points, *bare, "laplacian-mixed-soc", "-o", out("i.csv")]),
            (["i.vtu"], ["inspect", self.points, *bare, "laplacian-mixed-soc", "-o", out("i.vtu")]),
            (["t.csv"], [*diffuse, "--steady", "-o", out("t.csv")]),
            (["t.vtu"], [*diffuse, "--steady", "-o", out("t.vtu")]),
            (["s_0.vtu"], [*diffuse, "--time-step", 0.1, "--steps", 2, "--every", 1, "-o", out("s.vtu")]),
        ]
        self.studies = [
            ("convergence.csv", ["converge", "--points-max", 40]),
            ("stability_1d.csv", ["stability", "--quick", "--dimension", 1]),
            ("tradeoff_1d.csv", ["tradeoff", "--quick", "--dimension", 1]),
        ]

    def snapshot(self):
        return {p: p.read_bytes() for p in self.folder.rglob("*") if p.is_file()}

    def fails(self, command, *names, **how):
        """Runs what must end with exit code 1, an error that has one of these names in it, and all files as
        they were."""
        before = self.snapshot()
        how = {"stdout": subprocess.DEVNULL, **how}
        done = subprocess.run([PROGRAM, *map(str, command)], stderr=subprocess.PIPE, text=True, **how)
        self.assertEqual(done.returncode, 1, (command, done.stderr))
        self.assertTrue(without_times(done.stderr).startswith("error: "), done.stderr)
        self.assertTrue(any(str(name) in done.stderr for name in names), (names, done.stderr))
        self.assertEqual(self.snapshot(), before)
        return done.stderr

    def file_limit(self, size):
        """A disk on which no file grows beyond that."""
        if b"__tsan_init" in Path(PROGRAM).read_bytes():
            self.skipTest("the thread sanitizer's own memory is a file")
        return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))}

    def test_full_disk(self):
        for files, command in self.file_writers:
            for file in files:
                self.path(file).write_text("the old one")
            text = self.fails(command, self.path(files[0]), **self.file_limit(100))
            self.assertIn("cannot write", text)
            for file in files:
                self.path(file).unlink()
            self.fails(command, self.path(files[0]), **self.file_limit(100))  # none is there

    def test_full_device(self):
        for files, command in self.file_writers:
            for file in files:
                self.path(file).symlink_to("/dev/full")
                self.assertIn("No space left", self.fails(command, "/dev/full", self.path(file)))
                self.path(file).unlink()

    def test_a_folder_in_the_way(self):
        for files, command in [*self.file_writers, (["s.pvd"], self.file_writers[-1][1]),
                               (["t.png"], self.file_writers[-2][1])]:
            for file in files:
                self.path(file).mkdir()
                self.fails(command, self.path(file))
                self.path(file).rmdir()
                for left in self.folder.glob("s*.vtu"):
                    left.unlink()

    def test_a_folder_that_cannot_be_written(self):
        how = {"user": 65534} if os.geteuid() == 0 else {}
        self.folder.chmod(0o555)
        self.addCleanup(self.folder.chmod, 0o700)
        try:
            subprocess.run([PROGRAM, "schemes"], check=True, stdout=subprocess.DEVNULL, **how)
        except (PermissionError, subprocess.CalledProcessError):
            self.skipTest("another user cannot run the program")
        for files, command in self.file_writers:
            self.assertIn("Permission denied", self.fails(command, self.path(files[0]), **how))
        for _, command in self.studies:
            self.fails([*command, "--out", self.path("new")], self.path("new"), **how)

    def test_a_picture_that_does_not_fit_leaves_the_old_one(self):
        self.path("t.png").write_text("the old one")
        command = next(command for files, command in self.file_writers if files == ["t.csv"])
        done = subprocess.run([PROGRAM, *map(str, command)], capture_output=True, text=True,
                              **self.file_limit(8000))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("no picture", done.stdout)
        self.assertEqual(self.path("t.png").read_text(), "the old one")
        self.assertEqual(sorted(os.listdir(self.folder)), ["points.csv", "t.csv", "t.png"])

    def test_studies(self):
        out = self.path("out")
        for table, command in self.studies:
            self.fails([*command, "--out", self.points], self.points)
            out.mkdir(exist_ok=True)
            (out / table).write_text("the old one")
            self.fails([*command, "--out", out], out / table, **self.file_limit(100))

    def test_figures_that_do_not_fit_leave_the_old_ones(self):
        out = self.path("out")
        command = ["converge", "--points-max", 40, "--out", out]
        self.run_program(*command)
        os.truncate(out / "figure1.png", 3)
        size = max(p.stat().st_size for p in out.glob("convergence*"))
        self.fails(command, "figure", **self.file_limit(size + 100))

    def test_standard_output(self):
        matrix = self.path("l.mtx")
        self.run_program(*self.file_writers[0][1])
        for command in [["schemes"], ["schemes", "--json"], ["spmv", matrix],
                        ["advise", self.points, "--operator", "gradient", "--tolerance", 0.5, "--wavelength", 1],
                        ["inspect", self.points, "--scheme", "laplacian-mixed-soc", "--support", 0.4],
                        [*self.file_writers[0][1][:-1], "/dev/stdout"]]:
            reader, writer = os.pipe()
            os.close(reader)
            with os.fdopen(writer, "w") as closed, open("/dev/full", "w") as full:
                for out in [closed, full]:
                    self.assertIn("cannot write", self.fails(command, "standard output", "/dev/stdout", stdout=out))

    def test_standard_output_of_those_who_write_files(self):
        """Their files are whole then, and the failure still shows."""
        for files, command in [*self.file_writers, *[([f"out/{table}"], [*command, "--out", self.path("out")])
                                                     for table, command in self.studies[:1]]]:
            with open("/dev/full", "w") as full:
                done = subprocess.run([PROGRAM, *map(str, command)], stdout=full, stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 1, command)
            self.assertEqual(without_times(done.stderr), "error: cannot write to standard output\n")
            for file in files:
                self.assertGreater(self.path(file).stat().st_size, 100)
        self.assertEqual([p for p in self.folder.rglob("*") if "part" in p.name], [])

    def test_nothing_remains_of_a_program_that_is_killed(self):
        try:
            os.close(os.open(self.folder, os.O_TMPFILE | os.O_WRONLY))
        except OSError:
            self.skipTest("this file system has no files without a name")
        big = self.square(n=150)
        out = self.path("big.mtx")
        out.write_text("the old one")
        before = self.snapshot()
        command = [PROGRAM, "assemble", big, "--scheme", "laplacian-mixed-soc", "--support-ratio", "4", "-o", out]
        for signal_number in [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]:
            with subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL) as program:
                fds = Path(f"/proc/{program.pid}/fd")
                def is_writing():
                    try:
                        return any(str(self.folder) in os.readlink(fd) and str(fd.readlink()) != str(big)
                                   for fd in fds.iterdir())
                    except OSError:
                        return False
                while program.poll() is None and not is_writing():
                    pass
                program.send_signal(signal_number)
            self.assertEqual(program.returncode, -signal_number)
            self.assertEqual(self.snapshot(), before)


if __name__ == "__main__":
    unittest.main()
