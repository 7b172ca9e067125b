"""gradpsi as other projects take it up: installed and moved, found, linked and run. Run by CTest, one
class at a time; GRADPSI_BUILD is a build tree of this source tree."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).parent.parent
BUILD = Path(os.environ["GRADPSI_BUILD"])
WITH_PETSC = "GRADPSI_WITH_PETSC:BOOL=ON" in (BUILD / "CMakeCache.txt").read_text()
HEADERS = sorted(h for h in (SOURCE / "include" / "gradpsi").glob("*.hpp") if WITH_PETSC or not h.name.startswith("petsc"))

# What examples print, in reading order.
EXAMPLES = {
    "1_gradient": r"du/dx is 2 x to within \d\.\d+e-1[0-3]\n",
    "2_heat": r"Cholesky .*, mean temperature 0\.53\d*\n",
    "3_own_kernel": r"wendland-c2: rms error of the Laplacian 0\.00\d+\nbell: rms error of the Laplacian 0\.00\d+\n",
    "4_choosing": r" +rms error  entries a row  grows\n(laplacian-\S+ +\S+ +[\d.]+  (yes|no)\n){29}",
    "5_processes": r"conjugate gradients .* \(PETSc, 2 processes\), mean temperature 0\.53\d*\n",
    "6_sound": r"(\d000 steps: momentum changes by \de-1\d, energy by \d\.\de-\d+ of it\n){3}",
}
# With each of these Eigen aligns memory in another way.
FLAGS = ["", "-march=native", "-mavx2 -mfma", "-mavx512f -mavx512dq -mfma", "-DEIGEN_DONT_VECTORIZE", "-DEIGEN_DONT_ALIGN",
         *(f"-DEIGEN_MAX_ALIGN_BYTES={bytes}" for bytes in (0, 16, 32, 64)), "-march=native -fsanitize=address"]
CPU = Path("/proc/cpuinfo").read_text().split() if Path("/proc/cpuinfo").exists() else []
CONSUMER = r"grows 0, mean 0\.(49|50)\d*\nunknown scheme 'laplacian-mixed-socks'; valid: laplacian-mixed-soc, .*\n"


def run(*command, **options):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, cwd=SOURCE, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def symbols(library, *options):
    """Names of what a library defines for others, demangled, and their kinds."""
    lines = run("nm", "--demangle", "--defined-only", "--extern-only", *options, library).splitlines()
    found = [re.match(r"[0-9a-f]* *(\w) (.*)", line) for line in lines if " " in line]
    return [(m[1], m[2]) for m in found if m]


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)

    def configure(self, source, name, *options):
        run("cmake", "-S", source, "-B", self.folder / name, "-G", "Ninja", *options)

    def build(self, source, name, *options, targets=("all",), flags="-O0"):
        self.configure(source, name, "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_FLAGS={flags}", *options)
        run("cmake", "--build", self.folder / name, "--target", *targets)
        return self.folder / name


class InstalledTest(PackageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        run("cmake", "--install", BUILD, "--prefix", cls.folder / "first")
        cls.prefix = cls.folder / "moved"  # nothing may remember where it was
        shutil.move(cls.folder / "first", cls.prefix)
        pc, = cls.prefix.rglob("gradpsi.pc")
        cls.environment = {**os.environ, "PKG_CONFIG_PATH": str(pc.parent), "LD_LIBRARY_PATH": str(pc.parent.parent)}

    def by_pkg_config(self, source, *flags):
        """What a program prints that is compiled and linked as pkg-config says."""
        found = run("pkg-config", "--cflags", "--libs", "gradpsi", env=self.environment).split()
        program = self.folder / "by_pkg_config"
        run("g++", "-std=c++20", *flags, SOURCE / "tests" / "consumer" / source, "-o", program, *found)
        return run(program, env=self.environment)


class Installed(InstalledTest):

    def test_the_examples_link_to_it_and_run(self):
        built = self.build(SOURCE / "apps" / "examples", "examples", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.assertEqual(sorted(p.stem for p in (SOURCE / "apps" / "examples").glob("*.cpp")), list(EXAMPLES))
        for example, output in EXAMPLES.items():
            if example != "5_processes":
                self.assertRegex(run(built / example), "^" + output + "$")
            elif WITH_PETSC:
                mpirun = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", 2]
                self.assertRegex(run(*mpirun, built / example), "^" + output + "$")

    @unittest.skipUnless(WITH_PETSC, "built without PETSc")
    def test_the_component_is_there_for_those_who_ask(self):
        cmake, = self.prefix.rglob("gradpsiConfig.cmake")
        self.assertNotIn("petsc", (cmake.parent / "gradpsiTargets.cmake").read_text())
        text = run("mpirun", "--allow-run-as-root", "-n", 1, self.prefix / "bin" / "gradpsi-mpi", "--version")
        self.assertEqual(text.strip(), run(BUILD / "apps" / "gradpsi", "--version").strip())

    def test_versions_that_fit_are_found_and_others_refused(self):
        version = re.search(r"VERSION (\d+)\.(\d+)\.(\d+)", (SOURCE / "CMakeLists.txt").read_text())
        major, minor, patch = map(int, version.groups())
        project = self.folder / "version"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(version LANGUAGES CXX)\n"
            "find_package(gradpsi ${WANTED} CONFIG REQUIRED)\n")
        for wanted, fits in [(f"{major}.{minor}", True), (f"{major}.{minor}.{patch}", True),
                             (f"{major}.{minor + 1}", False), (f"{major + 1}.0", False)]:
            options = [f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DWANTED={wanted}"]
            if fits:
                self.configure(project, "found" + wanted, *options)
            else:
                with self.assertRaisesRegex(AssertionError, "compatible with requested version"):
                    self.configure(project, "refused" + wanted, *options)

    def test_pkg_config_knows_it(self):
        self.assertRegex(self.by_pkg_config("main.cpp"), "^" + CONSUMER + "$")

    def test_the_program_and_its_manual_are_there(self):
        text = run(self.prefix / "bin" / "gradpsi", "--version")
        self.assertEqual(text.strip(), run(BUILD / "apps" / "gradpsi", "--version").strip())
        self.assertTrue((self.prefix / "share" / "man" / "man1" / "gradpsi.1").exists())

    def test_everything_is_called_gradpsi(self):
        library, = self.prefix.rglob("libgradpsi.a")
        # Weak ones are templates of the standard library and of Eigen.
        strong = [name for kind, name in symbols(library) if kind not in "WVu"]
        self.assertGreater(len(strong), 100)
        for name in strong:
            self.assertRegex(name, r"^(guard variable for )?gradpsi::")
        installed = {p.relative_to(self.prefix / "include") for p in (self.prefix / "include").rglob("*.*")}
        self.assertEqual(installed, {Path("gradpsi") / header.name for header in HEADERS})
        for header in HEADERS:
            for macro in re.findall(r"#\s*define\s+(\w+)", header.read_text()):
                self.assertTrue(macro.startswith("GRADPSI_"), macro)


class Headers(unittest.TestCase):
    def test_each_compiles_alone(self):
        run("cmake", "--build", BUILD, "--target", "gradpsi_headers")


class Flags(InstalledTest):
    def test_41_memory_passes_the_border_whatever_the_program_is_compiled_with(self):
        # Without optimisation all of Eigen's functions are there to be mixed up; with it, most are inlined.
        for optimisation, some in [("-O0", FLAGS), ("-O2", ["-march=native"])]:
            for flags in some:
                if all(option[2:] in CPU for option in flags.split() if option.startswith("-mavx")):
                    with self.subTest(flags=f"{optimisation} {flags}"):
                        self.assertEqual(self.by_pkg_config("borders.cpp", optimisation, *flags.split()), "right\n")


class Alignment(PackageTest):
    def test_41_where_sparse_matrices_are_aligned_another_alignment_does_not_link(self):
        """As by Eigen 5. The Eigen of this machine is told to be one of its versions: what counts here is its number."""
        eigen, = re.findall(r"-I(\S+)", run("pkg-config", "--cflags", "eigen3"))
        shutil.copytree(Path(eigen) / "Eigen", self.folder / "eigen" / "Eigen")
        macros = self.folder / "eigen" / "Eigen" / "src" / "Core" / "util" / "Macros.h"
        macros.write_text(re.sub(r"(define EIGEN_MINOR_VERSION) \d+", r"\1 90", macros.read_text()))
        user = self.folder / "user.cpp"
        user.write_text("#include <gradpsi/matrix.hpp>\nint main() { return gradpsi::SparseMatrix(1, 1).nonZeros(); }\n")
        compiler = ["g++", "-std=c++20", f"-I{self.folder / 'eigen'}", f"-I{SOURCE / 'include'}"]
        library, program = self.folder / "library.o", self.folder / "user"
        run(*compiler, "-c", SOURCE / "lib" / "matrix" / "alignment.cpp", "-o", library)
        run(*compiler, "-O2", user, library, "-o", program)
        run(program)
        for bytes in [32, 64]:
            with self.assertRaisesRegex(AssertionError, fr"EigenAligns<{bytes}, \w+>::as_the_library_does\(\)"):
                run(*compiler, f"-DEIGEN_MAX_ALIGN_BYTES={bytes}", user, library, "-o", program)


class Subproject(PackageTest):
    """A shared library without CHOLMOD, unlike the one that is installed above."""

    def test_it_is_linked_passes_its_tests_and_brings_nothing_else(self):
        built = self.build(SOURCE / "tests" / "consumer", "subproject", "-DHOW=subdirectory",
                           f"-DGRADPSI_SOURCE={SOURCE}", "-DBUILD_SHARED_LIBS=ON", "-DGRADPSI_WITH_CHOLMOD=OFF",
                           "-DGRADPSI_BUILD_TESTS=ON", targets=["consumer", "gradpsi_solver_tests"], flags="-O1")
        self.assertRegex(run(built / "consumer"), "^" + CONSUMER + "$")
        run(built / "gradpsi" / "tests" / "gradpsi_solver_tests", "--gtest_brief=1")
        shared = built / "gradpsi" / "lib" / "libgradpsi.so"
        names = [name for kind, name in symbols(shared, "--dynamic")]
        self.assertGreater(len(names), 50)
        for name in names:
            self.assertRegex(name, r"^(typeinfo (name )?for )?gradpsi::")
        self.assertNotIn("cholmod", run("ldd", shared))

        program = self.folder / "borders"
        eigen = run("pkg-config", "--cflags", "eigen3").split()
        run("g++", "-std=c++20", "-march=native", f"-I{SOURCE / 'include'}", *eigen, SOURCE / "tests" / "consumer" / "borders.cpp",
            "-o", program, shared, f"-Wl,-rpath,{shared.parent}")
        self.assertEqual(run(program), "right\n")

    def test_it_can_be_fetched(self):
        self.configure(SOURCE / "tests" / "consumer", "fetched", "-DHOW=fetch", f"-DGRADPSI_SOURCE={SOURCE}")
        targets = run("cmake", "--build", self.folder / "fetched", "--target", "help")
        self.assertIn("libgradpsi.a:", targets)
        for other in ["gradpsi_tests", "gradpsi_program", "gradpsi_benchmarks"]:
            self.assertNotIn(other, targets)


class Documentation(unittest.TestCase):
    def test_the_version_is_written_once(self):
        version = re.search(r"VERSION (\d+\.\d+\.\d+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertIn(f"\n## {version}", (SOURCE / "CHANGELOG.md").read_text())
        files = run("git", "grep", "-lF", version, "--", "*.txt", "*.cmake", "*.json", "*.toml", "*.cff", "*.?pp", "*.py")
        self.assertEqual(files.split(), ["CMakeLists.txt"])

    @unittest.skipUnless(shutil.which("doxygen"), "doxygen is not installed")
    def test_the_reference_is_complete(self):
        run("cmake", "--build", BUILD, "--target", "gradpsi_reference")


if __name__ == "__main__":
    unittest.main(argv=sys.argv)
