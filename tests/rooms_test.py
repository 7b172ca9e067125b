"""The house: which room includes which, what each third-party header is tied to, and how long files and
functions are. It reads the source tree and needs nothing else."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).parent.parent

# What is still to be done, in the words of the tests below; each must be true.
KNOWN = {
}

# A room includes itself, those here, and what is below them. Values: what an assembly gives.
BELOW = {
    "base": [],
    "cloud": ["base"],
    "schemes": ["base"],
    "matrix": ["base"],
    "values": ["schemes"],
    "search": ["cloud"],
    "operators": ["search", "schemes", "values"],
    "calculus": ["matrix", "values"],
    "multigrid": ["search", "matrix"],
    "solve": ["multigrid"],
    "diffusion": ["solve", "values"],
    "diagnosis": ["cloud", "schemes", "matrix", "values"],
    "tolerance": ["operators", "diagnosis"],
    "io": ["cloud", "matrix"],
    "petsc": ["operators", "diffusion", "diagnosis", "io"],
    "python": ["all"],
    "all": ["operators", "calculus", "diffusion", "diagnosis", "tolerance", "io"],
}
PUBLIC = {
    "error": "base", "dense": "base", "matrix": "base",
    "cloud": "cloud", "neighbours": "search", "kernel": "schemes",
    "scheme": "schemes", "classification": "schemes", "cited": "schemes", "operator": "values", "assemble": "operators", "interpolate": "operators", "spmv": "matrix", "solver": "solve", "solver_options": "solve",
    "vector_calculus": "calculus",
    "walls": "operators", "diffusion": "diffusion", "poisson": "diffusion", "system": "diffusion", "rows": "diagnosis", "spectrum": "diagnosis", "tolerance": "tolerance", "io": "io", "table": "io",
    "petsc": "petsc", "petsc_partition": "petsc", "gradpsi": "all",
}
# Headers of others, and the only file that includes them; None: any one file.
TIED = {
    "lib": ["nanoflann.hpp", "Spectra/", "cholmod.h", "umfpack.h", "zoltan.h", "Eigen/Eigenvalues", "Eigen/SparseLU",
            "Eigen/SparseCholesky"],
    "apps": ["CLI/", "nlohmann/"],
}
FILE, HEADER, FUNCTION, BINDING = 400, 150, 60, 40
# Functions that were long once stay short.
SHORT = {"add_subcommand_to", "run", "find", "widen", "DiffusionSystem", "State", "growth_and_cure", "diagnose",
         "read_matrix_market", "result", "bicgstab", "corrected", "multiply_symmetric", "orders_of_least_squares"}


def sources(*folders):
    files = [f for folder in folders for f in (ROOT / folder).rglob("*.?pp")]
    return {str(f.relative_to(ROOT)): f.read_text() for f in sorted(files)}


def includes(text):
    """Of both kinds: the first character, < or ", and the name."""
    return re.findall(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', text, re.M)


def room(path):
    """Of a file of ours: a path from the root, or as it is written after #include."""
    parts = path.removeprefix("lib/").removeprefix("include/").split("/")
    return PUBLIC.get(Path(path).stem) if parts[0] == "gradpsi" else parts[0]


def reach(name):
    return {name}.union(*[reach(below) for below in BELOW[name]])


def without_comments(text):
    """Comments, preprocessor lines and the characters of literals blank; lines as they were."""
    def blank(found):
        return "\n" * found[0].count("\n") if found[0][0] in "/#" else '""' + "\n" * found[0].count("\n")
    return re.sub(r'//[^\n]*|/\*.*?\*/|^[ \t]*#(?:\\\n|[^\n])*|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\])\'',
                  blank, text, flags=re.S | re.M)


def functions(text):
    """Name and number of lines of each function, from its first line to its last brace."""
    text = without_comments(text)
    found, start, depth, at = [], 0, 0, 0
    while at < len(text):
        c = text[at]
        if c in "([":
            depth += 1
        elif c in ")]":
            depth -= 1
        elif depth > 0:
            pass
        elif c in ";}":
            start = at + 1
        elif c == "{":
            said = text[start:at].strip()
            if re.search(r"\)[^()]*$", said) and not re.search(r"\)\s*(?:noexcept)?\s*:(?!:)[^{]*[\w>]$|=$", said, re.S):
                end = closing(text, at)
                first = start + len(text[start:at]) - len(text[start:at].lstrip())
                found.append((re.search(r"([\w~]+|operator[^\s(]+)(?:<[^()]*>)?\s*\(", said)[1], text.count("\n", first, end) + 1))
                at, start = end, end + 1
            elif re.search(r"\b(?:namespace|class|struct|union|extern)\b[^=()]*$", said):
                start = at + 1
            else:  # an initialiser, an enumeration
                at = closing(text, at)
        at += 1
    return found


def closing(text, at):
    depth = 0
    for k in range(at, len(text)):
        depth += {"{": 1, "}": -1}.get(text[k], 0)
        if depth == 0:
            return k
    raise AssertionError("a brace is not closed")


class Rooms(unittest.TestCase):
    maxDiff = None

    def expect_none(self, kind, found):
        known = {k for k in KNOWN if k.split(":")[0] == kind}
        self.assertEqual(sorted(found - known), [], "must not be")
        self.assertEqual(sorted(known - found), [], "is done: take it out of KNOWN")

    def test_every_file_has_a_room(self):
        for path in sources("lib", "include"):
            self.assertIn(room(path), BELOW, path)

    def test_no_room_includes_one_above(self):
        found = set()
        for path, text in sources("lib", "include").items():
            for bracket, name in includes(text):
                if bracket == '"' and room(name) not in reach(room(path)):
                    found.add(f"upward: {path} includes {name}")
        self.expect_none("upward", found)

    def test_includes_are_written_from_lib(self):
        for path, text in sources("lib", "include").items():
            for bracket, name in includes(text):
                here = (ROOT / "lib" / name).exists() or (ROOT / "include" / name).exists()
                self.assertEqual(bracket == '"', here, f"{path} includes {name}")

    def test_programs_include_public_headers_and_their_own(self):
        found = set()
        for folder in ["apps", "benchmarks"]:
            for path, text in sources(folder).items():
                for bracket, name in includes(text):
                    own = (ROOT / folder / name).exists() or (ROOT / path).parent.joinpath(name).exists()
                    if name.startswith("gradpsi/"):
                        good = (ROOT / "include" / name).exists()
                    else:
                        good = bracket == "<" or name.endswith("_gp.hpp") or own and ".." not in name
                    if not good:
                        found.add(f"program: {path} includes {name}")
        self.expect_none("program", found)

    def test_a_header_of_others_is_included_once(self):
        found = set()
        for folder, headers in TIED.items():
            for header in headers:
                where = {path for path, text in sources(folder).items() for _, name in includes(text)
                         if name.startswith(header)}
                if len(where) != 1 or not where.pop().endswith(".cpp"):
                    found.add(f"tied: {header} in {folder}")
        self.expect_none("tied", found)

    def test_schemes_alone_are_told_apart_by_name(self):
        test = re.compile(r"\b(?:Derivative|Weight|Consistency)::[A-Z]|[.>](?:derivative|weight|consistency) *[!=]=|"
                          r"switch *\([^)]*\b(?:derivative|weight|consistency)\)")
        found = {f"by name: {path}" for path, text in sources("lib").items()
                 if room(path) != "schemes" and test.search(without_comments(text))}
        self.expect_none("by name", found)

    def test_files_are_short(self):
        found = set()
        for path, text in sources("lib", "include", "apps", "benchmarks").items():
            if text.count("\n") > (HEADER if path.endswith(".hpp") else FILE):
                found.add(f"long file: {path}")
        self.expect_none("long file", found)

    def test_functions_are_short(self):
        found = set()
        for path, text in sources("lib", "include", "apps", "benchmarks").items():
            for name, lines in functions(text):
                if lines > (BINDING if name in SHORT or room(path) == "python" else FUNCTION):
                    found.add(f"long function: {name} in {path}")
        self.expect_none("long function", found)

    def test_functions_are_measured(self):
        text = "\n".join(["namespace a {", "/// f() {", "struct B : C {", "  B(int x)", "      : C{x}, y_(x) {", "    f();", "  }",
                          "  int y_ = 1, z_{2};", "};", "constexpr D d[] = {{[](int) { return 1; }}};", "template <class T>",
                          "auto f(T t = {}) -> T {", "  if (t) {", '    g("{");', "  }", "  return t;", "}", "}"])
        self.assertEqual(functions(text), [("B", 4), ("f", 7)])


if __name__ == "__main__":
    unittest.main()
