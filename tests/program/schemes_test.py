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

    def test_help_and_version(self):
        self.assertIn("assemble", self.run_program("--help"))
        self.assertRegex(self.run_program("--version"), r"^\d+\.\d+\.\d+\n$")


if __name__ == "__main__":
    unittest.main()
