"""Files from Python, read by scipy and meshio where those can."""

import gc

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import gradpsi
from conftest import operator, same, square


def test_tables_come_back_to_the_last_bit(tmp_path):
    random = np.random.default_rng(1)
    columns = {"x": random.random(9), "T": 1e-300 * random.random(9), "flag": np.arange(9) > 3}
    gradpsi.write_csv(tmp_path / "a.csv", columns)
    read = gradpsi.read_csv(str(tmp_path / "a.csv"))
    assert list(read) == ["x", "T", "flag"]
    for name, values in columns.items():
        assert np.array_equal(read[name], values)


def test_bad_tables_are_refused(tmp_path):
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.write_csv(tmp_path / "a.csv", {"x": [1, 2], "y": [1]})
    with pytest.raises(gradpsi.InvalidInput, match="y must be real numbers"):
        gradpsi.write_csv(tmp_path / "a.csv", {"x": [1, 2], "y": ["a", "b"]})
    (tmp_path / "b.csv").write_text("x,y\n1,2\n3,four\n")
    assert gradpsi.read_csv(tmp_path / "b.csv")["y"] == ["2", "four"]
    with pytest.raises(gradpsi.InvalidInput, match="b.csv.*3"):
        gradpsi.read_cloud(tmp_path / "b.csv")


def test_files_that_are_not_there_are_named(tmp_path):
    for read in [gradpsi.read_cloud, gradpsi.read_csv, gradpsi.read_matrix_market]:
        with pytest.raises(FileNotFoundError, match="nowhere.csv"):
            read(tmp_path / "nowhere.csv")
    with pytest.raises(OSError, match="no-folder"):
        gradpsi.write_csv(tmp_path / "no-folder" / "a.csv", {"x": [1.0]})
    with pytest.raises(IsADirectoryError):
        gradpsi.read_csv(tmp_path)


def test_matrices_come_back_to_the_last_bit(tmp_path):
    A = operator("gradient-direct-soc", square()).matrix
    gradpsi.write_matrix_market(tmp_path / "A.mtx", A)
    B = gradpsi.read_matrix_market(tmp_path / "A.mtx")
    assert same(A, B)
    assert (A != scipy.io.mmread(tmp_path / "A.mtx").tocsr()).nnz == 0
    B.indices[0] = 0  # its own memory: free to write, and alive without anything else
    gc.collect()
    B.eliminate_zeros()
    (tmp_path / "bad.mtx").write_text("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n")
    with pytest.raises(gradpsi.InvalidInput, match="bad.mtx"):
        gradpsi.read_matrix_market(tmp_path / "bad.mtx")


def test_symmetric_matrices_are_read_with_both_triangles(tmp_path):
    A = scipy.sparse.csr_matrix([[2.0, 1, 0], [1, 2, 0], [0, 0, 5]])
    scipy.io.mmwrite(tmp_path / "A.mtx", A, symmetry="symmetric")
    assert same(gradpsi.read_matrix_market(tmp_path / "A.mtx"), A)


def test_fields_are_written_for_paraview(tmp_path):
    meshio = pytest.importorskip("meshio")
    cloud = square()
    T = cloud.positions[:, 0]
    gradpsi.write_vtu(tmp_path / "a.vtu", cloud, {"T": T})
    mesh = meshio.read(tmp_path / "a.vtu")
    assert np.array_equal(mesh.points[:, :2], cloud.positions)
    assert np.array_equal(np.ravel(mesh.point_data["T"]), T)
    gradpsi.write_vtu(tmp_path / "b.vtu", cloud)
    gradpsi.write_pvd(tmp_path / "a.pvd", [(0.0, "a.vtu"), (0.5, tmp_path / "b.vtu")])
    assert "0.5" in (tmp_path / "a.pvd").read_text()
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.write_vtu(tmp_path / "c.vtu", cloud, {"T": T[1:]})
