# Checked against the module by tests/python/stub_test.py: the same names, arguments and defaults.

import enum
import os
from collections.abc import Mapping, Sequence
from typing import Literal, overload

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

_Path = str | os.PathLike[str]
_Doubles = NDArray[np.float64]
_Ints = NDArray[np.int32]

__version__: str

class InvalidInput(ValueError): ...

class StencilError(RuntimeError):
    point: int
    neighbours: int
    reciprocal_condition: float

class SolverError(RuntimeError):
    residual: float

def kernels() -> list[str]: ...
def kernel_values(
    kernel: str, dimension: int, support: float, r: ArrayLike
) -> tuple[_Doubles, _Doubles, _Doubles]: ...

class Scheme:
    def __init__(self, name: str) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def derivative(self) -> Literal["gradient", "laplacian", "hessian", "value"]: ...
    @property
    def weight(self) -> str: ...
    @property
    def consistency(self) -> str: ...
    @property
    def degree(self) -> int: ...
    @property
    def formula(self) -> str: ...
    @property
    def conditions(self) -> str: ...
    @property
    def symmetry(self) -> Literal["none", "symmetric", "antisymmetric"]: ...
    @property
    def support_ratio(self) -> float | None: ...
    def unknowns(self, dimension: int) -> int: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...

def schemes() -> list[Scheme]: ...

class Cloud:
    def __init__(
        self,
        positions: ArrayLike,
        volumes: ArrayLike | None = None,
        box: ArrayLike | None = None,
    ) -> None: ...
    def __len__(self) -> int: ...
    @property
    def dimension(self) -> int: ...
    @property
    def positions(self) -> _Doubles: ...
    @property
    def volumes(self) -> _Doubles | None: ...
    @property
    def box(self) -> tuple[float, ...]: ...
    def spacing(self, threads: int = 0) -> float: ...

def read_cloud(file: _Path) -> Cloud: ...
def lattice(
    points_per_side: int,
    *,
    dimension: int = 2,
    lower: float = 0.0,
    upper: float = 1.0,
    jitter: float = 0.0,
    seed: int = 1,
    periodic: bool = False,
    grading: float = 1.0,
) -> Cloud: ...
def distinct_points(cloud: Cloud) -> _Ints: ...
def reorder(cloud: Cloud, threads: int = 0) -> tuple[Cloud, _Ints]: ...

class Neighbours:
    def __len__(self) -> int: ...
    def of(self, point: int) -> _Ints: ...
    @property
    def offsets(self) -> _Ints: ...
    @property
    def indices(self) -> _Ints: ...
    @property
    def supports(self) -> _Doubles: ...
    @property
    def order(self) -> _Ints: ...
    @property
    def skin(self) -> float: ...

def find_neighbours(
    cloud: Cloud, support: ArrayLike, threads: int = 0, *, skin: float | None = None
) -> Neighbours: ...
def is_stale(near: Neighbours, cloud: Cloud, threads: int = 0) -> bool: ...
def nearest_distances(cloud: Cloud, threads: int = 0) -> _Doubles: ...
def kth_nearest_distances(cloud: Cloud, k: int, threads: int = 0) -> _Doubles: ...
def local_spacing(cloud: Cloud, threads: int = 0) -> _Doubles: ...
def number_density_volumes(
    cloud: Cloud, near: Neighbours, kernel: str = "wendland-c2", threads: int = 0
) -> _Doubles: ...

class RowOutcome(enum.IntEnum):
    AS_ASKED = 0
    LOWERED = 1
    WIDENED = 2
    ZERO = 3

class RowReport:
    @property
    def neighbours(self) -> _Ints: ...
    @property
    def supports(self) -> _Doubles: ...
    @property
    def reciprocal_condition(self) -> _Doubles: ...
    @property
    def outcome(self) -> NDArray[np.uint8]: ...
    @property
    def degree(self) -> _Ints: ...
    @property
    def schemes(self) -> list[Scheme | None]: ...
    @property
    def errors(self) -> _Doubles: ...
    @property
    def degenerate(self) -> int: ...

class Operator:
    @property
    def axes(self) -> list[scipy.sparse.csr_matrix]: ...
    @property
    def matrix(self) -> scipy.sparse.csr_matrix: ...
    @property
    def volumes(self) -> _Doubles: ...
    @property
    def rows(self) -> RowReport: ...
    @property
    def normals(self) -> _Doubles: ...

_OnDegenerate = Literal["fail", "lower", "widen", "zero"]

@overload
def assemble(  # type: ignore[misc]  # a str is a sequence of str, too
    scheme: Scheme | str,
    cloud: Cloud,
    near: Neighbours,
    *,
    kernel: str = "wendland-c2",
    on_degenerate: _OnDegenerate = "fail",
    rows: ArrayLike | None = None,
    on_surface: bool = False,
    threads: int = 0,
) -> Operator: ...
@overload
def assemble(
    scheme: Sequence[Scheme | str],
    cloud: Cloud,
    near: Neighbours,
    *,
    kernel: str = "wendland-c2",
    on_degenerate: _OnDegenerate = "fail",
    rows: ArrayLike | None = None,
    on_surface: bool = False,
    threads: int = 0,
) -> list[Operator]: ...
def reassemble(
    scheme: Scheme | str,
    cloud: Cloud,
    near: Neighbours,
    op: Operator,
    *,
    kernel: str = "wendland-c2",
    on_degenerate: _OnDegenerate = "fail",
    rows: ArrayLike | None = None,
    on_surface: bool = False,
    threads: int = 0,
) -> None: ...
def assemble_to(
    derivative: Literal["gradient", "laplacian", "hessian"],
    cloud: Cloud,
    *,
    tolerance: float,
    wavelength: ArrayLike,
    kernel: str = "wendland-c2",
    on_miss: Literal["fail", "lower", "zero"] = "fail",
    stable: bool = False,
    fixed: ArrayLike | None = None,
    threads: int = 0,
) -> Operator: ...
def certified_errors(
    derivative: Literal["gradient", "laplacian", "hessian", "value"],
    cloud: Cloud,
    op: Operator,
    wavelength: ArrayLike,
    *,
    threads: int = 0,
) -> _Doubles: ...
def multiply(op: Operator, u: ArrayLike, threads: int = 0) -> _Doubles: ...
@overload
def interpolate(  # type: ignore[misc]  # a str is a sequence of str, too
    scheme: Scheme | str,
    cloud: Cloud,
    probes: ArrayLike,
    supports: ArrayLike | None = None,
    *,
    kernel: str = "wendland-c2",
    threads: int = 0,
) -> Operator: ...
@overload
def interpolate(
    scheme: Sequence[Scheme | str],
    cloud: Cloud,
    probes: ArrayLike,
    supports: ArrayLike | None = None,
    *,
    kernel: str = "wendland-c2",
    threads: int = 0,
) -> list[Operator]: ...
def conservative_transfer(
    value: Operator, probe_volumes: ArrayLike
) -> scipy.sparse.csr_matrix: ...
def with_symmetric_supports(
    scheme: Scheme | str, op: Operator, threads: int = 0
) -> Operator: ...
def with_conductivity(
    laplacian: Operator,
    conductivity: ArrayLike,
    mean: Literal["arithmetic", "harmonic"] = "arithmetic",
    *,
    gradient: Operator | None = None,
) -> Operator: ...

_VectorOperator = Literal[
    "gradient", "divergence", "curl", "velocity-gradient", "strain", "grad-div"
]

def vector_derivative(
    what: _VectorOperator, op: Operator, v: ArrayLike, threads: int = 0
) -> _Doubles: ...
def block_matrix(
    what: _VectorOperator, op: Operator, threads: int = 0
) -> scipy.sparse.csr_matrix: ...
def viscous_force(
    hessian: Operator, gradient: Operator, mu: ArrayLike, threads: int = 0
) -> scipy.sparse.csr_matrix: ...
def conservative_companion(
    gradient: Operator, threads: int = 0
) -> list[scipy.sparse.csr_matrix]: ...
def with_walls(
    laplacian: Operator,
    cloud: Cloud,
    near: Neighbours,
    points: ArrayLike,
    normals: ArrayLike,
    flux: ArrayLike | None = None,
    transfer: ArrayLike | None = None,
    threads: int = 0,
) -> tuple[Operator, _Doubles, _Ints]: ...

class SolverOptions:
    def __init__(
        self,
        *,
        method: Literal["auto", "cholesky", "lu", "krylov", "multigrid"] = "auto",
        tolerance: float = 1e-12,
        max_iterations: int = 10000,
        ordering: Literal["coordinates", "amd", "metis"] = "coordinates",
        memory: float = 0.0,
        threads: int = 0,
        solves: int = 0,
        mean: float | None = None,
    ) -> None: ...
    @property
    def method(self) -> str: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def ordering(self) -> str: ...
    @property
    def memory(self) -> float: ...
    @property
    def threads(self) -> int: ...
    @property
    def solves(self) -> int: ...
    @property
    def mean(self) -> float | None: ...

class FactorReport:
    @property
    def description(self) -> str: ...
    @property
    def entries(self) -> float: ...
    @property
    def flops(self) -> float: ...
    @property
    def bytes(self) -> float: ...
    @property
    def analyse_seconds(self) -> float: ...
    @property
    def factor_seconds(self) -> float: ...

class SolverReport:
    @property
    def method(self) -> Literal["cholesky", "lu", "krylov", "multigrid"]: ...
    @property
    def description(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def unknowns(self) -> int: ...
    @property
    def factor(self) -> FactorReport: ...
    @property
    def caution(self) -> str: ...

class SolveReport:
    @property
    def residual(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def removed(self) -> float: ...

class LinearSolver:
    def __init__(
        self,
        matrix: scipy.sparse.spmatrix,
        options: SolverOptions = ...,
        cloud: Cloud | None = None,
        walls: ArrayLike | None = None,
    ) -> None: ...
    def solve(self, b: ArrayLike, guess: ArrayLike | None = None) -> _Doubles: ...
    def refactor(self, matrix: scipy.sparse.spmatrix) -> None: ...
    @property
    def report(self) -> SolverReport: ...
    @property
    def latest(self) -> SolveReport | None: ...

class WallConditions:
    def __init__(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        gradient: Operator,
        flux: ArrayLike | None = None,
        transfer: ArrayLike | None = None,
    ) -> None: ...

class ImplicitDiffusion:
    def __init__(
        self,
        cloud: Cloud,
        laplacian: Operator,
        *,
        time_step: float,
        diffusivity: float = 1.0,
        theta: float = 1.0,
        source: ArrayLike | None = None,
        fixed: ArrayLike | None = None,
        fixed_values: ArrayLike | None = None,
        walls: WallConditions | None = None,
        solver: SolverOptions = ...,
    ) -> None: ...
    def step(self, u: ArrayLike) -> _Doubles: ...
    def damped_step(self, u: ArrayLike) -> _Doubles: ...
    def set_time_step(self, time_step: float) -> None: ...
    def update(
        self,
        cloud: Cloud,
        laplacian: Operator,
        *,
        fixed: ArrayLike | None = None,
        fixed_values: ArrayLike | None = None,
        walls: WallConditions | None = None,
    ) -> None: ...
    @property
    def solver(self) -> SolverReport: ...
    @property
    def latest(self) -> SolveReport | None: ...

class Poisson:
    def __init__(
        self,
        cloud: Cloud,
        laplacian: Operator,
        *,
        fixed: ArrayLike | None = None,
        fixed_values: ArrayLike | None = None,
        walls: WallConditions | None = None,
        solver: SolverOptions = ...,
    ) -> None: ...
    def solve(self, f: ArrayLike, guess: ArrayLike | None = None) -> _Doubles: ...
    def update(
        self,
        cloud: Cloud,
        laplacian: Operator,
        *,
        fixed: ArrayLike | None = None,
        fixed_values: ArrayLike | None = None,
        walls: WallConditions | None = None,
    ) -> None: ...
    @property
    def solver(self) -> SolverReport: ...
    @property
    def latest(self) -> SolveReport | None: ...

class RowDiagnosis:
    @property
    def amplification(self) -> _Doubles: ...
    @property
    def negative_share(self) -> _Doubles: ...
    @property
    def residuals(self) -> _Doubles: ...
    @property
    def remainders(self) -> _Doubles: ...

def warnings(cloud: Cloud, near: Neighbours, *, threads: int = 0) -> list[str]: ...
def diagnose(
    scheme: Scheme | str, cloud: Cloud, op: Operator, threads: int = 0
) -> RowDiagnosis: ...
def error_bound(rows: RowDiagnosis, derivatives: ArrayLike) -> _Doubles: ...

class MatrixSummary:
    @property
    def symmetric(self) -> bool: ...
    @property
    def dominant(self) -> bool: ...
    @property
    def m_matrix(self) -> bool: ...
    @property
    def bandwidth(self) -> int: ...
    @property
    def leftmost(self) -> float: ...
    @property
    def rightmost(self) -> float: ...
    @property
    def solver(self) -> Literal["cholesky", "lu"]: ...

def summarise(laplacian: scipy.sparse.spmatrix, volumes: ArrayLike) -> MatrixSummary: ...

class Forecast:
    @property
    def grows(self) -> bool: ...
    @property
    def certain(self) -> bool: ...
    @property
    def point(self) -> int: ...
    @property
    def rate(self) -> float: ...

def forecast(
    cloud: Cloud, laplacian: scipy.sparse.spmatrix, points: ArrayLike, volumes: ArrayLike
) -> Forecast: ...

class Spectrum:
    @property
    def values(self) -> NDArray[np.complex128]: ...
    @property
    def complete(self) -> bool: ...
    @property
    def zero(self) -> float: ...
    @property
    def rightmost(self) -> float: ...
    @property
    def leftmost(self) -> float: ...
    @property
    def widest(self) -> float: ...
    @property
    def grows(self) -> bool: ...

def spectrum(
    matrix: scipy.sparse.spmatrix,
    volumes: ArrayLike | None = None,
    *,
    complete_below: int = 2000,
    threads: int = 0,
) -> Spectrum: ...
def largest_stable_step(
    spectrum: Spectrum, stepper: Literal["euler", "runge-kutta-4"]
) -> float: ...
def singular_steps(spectrum: Spectrum) -> _Doubles: ...
def read_csv(file: _Path) -> dict[str, _Doubles | list[str]]: ...
def write_csv(file: _Path, columns: Mapping[str, ArrayLike]) -> None: ...
def write_vtu(file: _Path, cloud: Cloud, fields: Mapping[str, ArrayLike] = {}) -> None: ...
def write_pvd(file: _Path, series: Sequence[tuple[float, _Path]]) -> None: ...
def read_matrix_market(file: _Path) -> scipy.sparse.csr_matrix: ...
def write_matrix_market(file: _Path, matrix: scipy.sparse.spmatrix) -> None: ...
