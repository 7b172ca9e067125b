"""README.md against what is there."""

import re
import subprocess
import unittest

from program import PROGRAM, ROOT


class Readme(unittest.TestCase):
    def test_it_quotes_the_examples_to_the_letter(self):
        for example in (ROOT / "apps" / "examples").glob("*.cpp"):
            self.assertIn("```cpp\n" + example.read_text() + "```\n", (ROOT / "README.md").read_text())
        example = ROOT / "apps" / "python" / "example.py"
        self.assertIn("```python\n" + example.read_text() + "```\n", (ROOT / "README.md").read_text())

    def test_it_names_every_kernel(self):
        done = subprocess.run([PROGRAM, "assemble", "--help"], capture_output=True, text=True)
        kernels = re.search("One of (wendland.*)", done.stdout).group(1)
        for kernel in kernels.split(", "):
            self.assertIn("`" + kernel.strip() + "`", (ROOT / "README.md").read_text())


if __name__ == "__main__":
    unittest.main()
