from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.bem import database
from tlpsim.loads.bem.database import Problem, cached, compute, problem_key, read, write
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.errors import ScenarioError

PROBLEM = Problem(
    mesh=box(2.0, 1.0, 0.5, 0.5), omega=np.array([0.5, 1.0]), heading=np.array([0.0, 0.4, 1.0]), depth=5.0
)


def test_file_gives_the_database_back(tmp_path: Path) -> None:
    first = compute(PROBLEM)
    write(first, tmp_path / "hydro.h5")
    second = read(tmp_path / "hydro.h5")
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))
    with h5py.File(tmp_path / "hydro.h5") as file:
        assert file["added_mass"].shape == (2, 6, 6)
        assert file["excitation_force"].shape == (3, 2, 6)
        assert file["mean_drift"].shape == (3, 2, 3)
        assert file["omega"].attrs["unit"] == "rad/s"


def test_unchanged_problem_is_not_solved_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, int]] = []
    first = cached(PROBLEM, tmp_path, lambda done, total: seen.append((done, total)))
    assert seen == [(1, 2), (2, 2)]
    monkeypatch.setattr(database, "compute", lambda *_: pytest.fail("solved again"))
    second = cached(replace(PROBLEM, mesh=replace(PROBLEM.mesh, name="other name")), tmp_path)
    np.testing.assert_array_equal(first.added_mass, second.added_mass)


@pytest.mark.parametrize(
    "change",
    [
        {"depth": np.inf},
        {"density": 1000.0},
        {"gravity": 9.81},
        {"omega": np.array([0.5, 1.1])},
        {"heading": np.array([0.0])},
        {"mesh": box(2.0, 1.0, 0.5, 0.25)},
        {"mass": np.eye(6)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_key_tells_problems_apart(change: dict[str, object]) -> None:
    assert problem_key(replace(PROBLEM, **change)) != problem_key(PROBLEM)  # type: ignore[arg-type]


def test_bad_problems_and_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="ascend"):
        compute(replace(PROBLEM, omega=np.array([1.0, 0.5])))
    with pytest.raises(ScenarioError, match="both"):
        compute(replace(PROBLEM, mass=np.eye(6)))
    with pytest.raises(ScenarioError, match="not a hydrodynamic database"):
        read(tmp_path / "missing.h5")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    with pytest.raises(ScenarioError, match="schema"):
        read(tmp_path / "other.h5")
