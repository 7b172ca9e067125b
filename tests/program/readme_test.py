"""The pages against what is there."""

import re
import subprocess
import unittest

from program import PROGRAM, ROOT

PAGES = sorted(ROOT.glob("*.md")) + sorted(p for f in ["apps", "benchmarks", "lib", "tests"] for p in (ROOT / f).rglob("*.md"))


def without_code(page):
    return re.sub(r"^```.*?^```|^    .*?$|`[^`\n]*`", "", page.read_text(), flags=re.S | re.M)


def anchors(page):
    """Of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M), re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


class Pages(unittest.TestCase):
    def test_they_quote_the_examples_to_the_letter(self):
        examples = sorted((ROOT / "apps" / "examples").glob("*.cpp")) + [ROOT / "apps" / "python" / "example.py"]
        for example in examples:
            language = {".cpp": "cpp", ".py": "python"}[example.suffix]
            comment = f"<!-- {example.relative_to(ROOT)}, run by the tests -->\n"
            quoted = comment + f"```{language}\n" + example.read_text() + "```\n"
            self.assertEqual(sum(quoted in page.read_text() for page in PAGES), 1, example)

    def test_they_name_every_kernel(self):
        done = subprocess.run([PROGRAM, "assemble", "--help"], capture_output=True, text=True)
        kernels = re.search("One of (wendland.*)", done.stdout).group(1)
        for kernel in kernels.split(", "):
            self.assertIn("`" + kernel.strip() + "`", (ROOT / "lib" / "schemes" / "README.md").read_text())

    def test_every_link_leads_somewhere(self):
        for page in PAGES:
            links = re.findall(r'\]\(([^)]*)\)|<img src="([^"]*)"', without_code(page))
            for link in (a or b for a, b in links):
                if link.startswith("http"):
                    continue
                file, _, anchor = link.partition("#")
                target = page.parent / file if file else page
                self.assertTrue(target.exists(), f"{page} links to {link}")
                if anchor:
                    self.assertIn(anchor, anchors(target), f"{page} links to {link}")


class Readme(unittest.TestCase):
    def test_it_is_short(self):
        lines = (ROOT / "README.md").read_text().splitlines()
        self.assertLessEqual(len(lines), 120)
        self.assertLessEqual(max(map(len, lines)), 120)

    def test_it_starts_with_a_picture_and_a_program(self):
        first_screen = "".join((ROOT / "README.md").read_text().splitlines(True)[:40])
        self.assertRegex(first_screen, r"<img|!\[")
        self.assertIn((ROOT / "apps" / "examples" / "1_gradient.cpp").read_text(), first_screen)

    def test_it_names_the_commands_that_build_and_test(self):
        for script in ["apps/run.sh", "tests/run.sh"]:
            self.assertRegex((ROOT / "README.md").read_text(), rf"\n    bash {script} ")
            self.assertTrue((ROOT / script).exists())


if __name__ == "__main__":
    unittest.main()
