"""Every help text and the manual page."""

import re
import subprocess
import unittest

import numpy as np

from program import PROGRAM, ProgramTest, without_times


class Help(ProgramTest):
    def commands(self):
        listed = self.run_program("--help").split("Subcommands:\n")[1].split("\n\n")[0]
        return re.findall(r"^  (\w+)  ", listed, re.M)

    def examples(self, *command):
        text = self.run_program(*command, "--help").replace("\\\n", " ")
        return re.findall(r"^(?:Example: |  )gradpsi (\w+ .*)$", text, re.M)

    def test_every_help_shows_an_example_that_runs(self):
        self.square(n=20, T=lambda x, y: np.cos(4 * x + y), wall=lambda x, y: x < 0.1,
                    vx=lambda x, y: y, vy=lambda x, y: np.sin(x))
        self.path("probes.csv").write_text("x,y\n0.5,0.5\n0.25,0.75\n")
        self.assertGreaterEqual(len(self.commands()), 11)
        examples = self.examples()  # of the program itself; later ones use what it writes
        self.assertTrue(examples)
        for command in self.commands():
            own = [e for e in self.examples(command) if e.startswith(command + " ")]
            self.assertTrue(own, command)
            examples += own
        for example in examples:
            if example.split()[0] in ("converge", "stability", "tradeoff"):
                self.assertRegex(example, r"^\w+ --quick --out results$")  # run by the tests of their names
                continue
            arguments = example.split("|")[0].split()
            done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, cwd=self.folder)
            self.assertEqual((done.returncode, without_times(done.stderr)), (0, ""), example)
            for output in re.findall(r"-o (\S+)", example):
                stem, end = output.rsplit(".", 1)
                made = [self.path(output), self.path(f"{stem}_x.{end}")]
                self.assertTrue("|" in example or any(file.exists() for file in made), output)

    def test_the_manual_page_is_sound_and_complete(self):
        page = self.run_program("manual")
        rendered = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-P-cbou"], input=page.encode(), capture_output=True)
        self.assertEqual((rendered.returncode, rendered.stderr), (0, b""))
        text = " ".join(rendered.stdout.decode().replace("\u2010\n", "").split())
        for command in self.commands():
            self.assertIn("gradpsi " + command, text)
            for option in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", self.run_program(command, "--help"), re.M):
                self.assertTrue(option == "--help" or option in text, option)


if __name__ == "__main__":
    unittest.main()
