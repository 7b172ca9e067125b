"""gradpsi schemes, --help and --version."""

import json
import unittest

from program import ProgramTest


class Schemes(ProgramTest):
    def test_json_lists_the_seventeen_first(self):
        schemes = json.loads(self.run_program("schemes", "--json"))
        self.assertTrue(all(s["consistency"] in ("zoc", "foc", "soc") for s in schemes[:17]))
        self.assertEqual(schemes[17]["consistency"], "soc-ls")
        mixed = next(s for s in schemes if s["name"] == "laplacian-mixed-zoc")
        self.assertEqual(mixed["formula"], "omega_j (-2 W'/r)")
        self.assertEqual(mixed["volume_scaled_symmetry"], "symmetric")

    def test_table_has_a_line_for_each(self):
        text = self.run_program("schemes")
        for scheme in json.loads(self.run_program("schemes", "--json")):
            self.assertIn("\n" + scheme["name"] + " ", text)

    def test_what_the_paper_cites(self):
        known = {s["name"]: s for s in json.loads(self.run_program("schemes", "--json"))}
        cited = json.loads(self.run_program("schemes", "--cited", "--json"))
        self.assertEqual({n for s in cited for n in s["reference"].split()}, {f"[{n}]" for n in range(4, 20)})
        text = self.run_program("schemes", "--cited")
        for system in cited:
            self.assertNotEqual(system["name"] in known, system["equal_to"] in known, system)
            own = known[system["equal_to"] or system["name"]]
            self.assertEqual((system["formula"], system["conditions"]), (own["formula"], own["conditions"]))
            self.assertRegex(text, r"\n\[[^\n]* " + system["name"] + " ")

    def test_help_and_version(self):
        self.assertIn("assemble", self.run_program("--help"))
        self.assertRegex(self.run_program("--version"), r"^\d+\.\d+\.\d+\n$")


if __name__ == "__main__":
    unittest.main()
