import re
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.bem import database
from tlpsim.loads.bem.database import (
    ERROR_BARS,
    Problem,
    cache_path,
    cached,
    compute,
    is_database,
    limit_where_finite,
    problem_key,
    read,
    write,
)
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hemisphere import hemisphere_coefficients
from tlpsim.loads.bem.hulls import box, hemisphere
from tlpsim.loads.bem.response import mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.rigid_body import mass_matrix

PROBLEM = Problem(
    mesh=box(2.0, 1.0, 0.5, 0.5), omega=np.array([0.5, 1.0]), heading=np.array([0.0, 0.4, 1.0]), depth=5.0
)
MOVING = replace(
    PROBLEM, mass=mass_matrix(1025.0, [0.0, 0.0, -0.1], np.diag([1e2, 3e2, 4e2])), stiffness=np.diag([1e4] * 6)
)


def assert_equal(first: object, second: object) -> None:
    """Records with arrays in them: field by field, bit for bit."""
    if is_dataclass(first):
        assert type(first) is type(second)
        for field in fields(first):
            assert_equal(getattr(first, field.name), getattr(second, field.name))
    elif isinstance(first, np.ndarray):
        np.testing.assert_array_equal(first, second)
        assert first.dtype == second.dtype  # type: ignore[attr-defined]
    else:
        assert first == second


@pytest.mark.parametrize("problem", [PROBLEM, MOVING], ids=["fixed", "moving"])
def test_file_gives_the_database_back(tmp_path: Path, problem: Problem) -> None:
    first = compute(problem)
    write(first, tmp_path / "hydro.h5")
    assert_equal(first, read(tmp_path / "hydro.h5"))
    assert is_database(tmp_path / "hydro.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["hydro.h5"]
    with h5py.File(tmp_path / "hydro.h5") as file:
        assert file.attrs["schema"] == "tlpsim hydrodynamic database 2"
        assert file["added_mass"].shape == (2, 6, 6)
        assert file["excitation_force"].shape == (3, 2, 6)
        assert file["mean_drift"].shape == (3, 2, 3)
        assert file["hydrostatics/stiffness"].shape == (6, 6)
        assert file["mesh/vertices"].shape == (len(problem.mesh.vertices), 4, 3)
        assert ("response_amplitude" in file) == (problem is MOVING)

        def told(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                assert item.attrs["unit"], name

        file.visititems(told)


def test_what_is_not_known_stays_unknown(tmp_path: Path) -> None:
    first = replace(compute(PROBLEM), hydrostatics=None, mesh=None, added_mass_zero=np.full((6, 6), np.nan))
    write(first, tmp_path / "hydro.h5")
    assert_equal(first, read(tmp_path / "hydro.h5"))


def test_moving_body_has_its_motion_and_the_drift_of_it() -> None:
    """Against one frequency solved by hand."""
    assert MOVING.mass is not None
    assert MOVING.stiffness is not None
    found = compute(MOVING)
    body = discretize(MOVING.mesh, MOVING.depth)
    solution = solve(body, 1.0, MOVING.heading, MOVING.density, MOVING.gravity)
    motion = response_amplitudes(solution, MOVING.mass, MOVING.stiffness)
    assert found.response_amplitude is not None
    np.testing.assert_allclose(found.response_amplitude[:, 1], motion, rtol=1e-9, atol=1e-12)
    drift = mean_drift(body, solution, motion)
    np.testing.assert_allclose(found.mean_drift[:, 1], drift, rtol=1e-9, atol=1e-9 * np.max(np.abs(drift)))


def imports(path: Path) -> set[str]:
    """Modules of `tlpsim.loads.bem` that a file imports, and those that these import."""
    found: set[str] = set()
    waiting = [path]
    while waiting:
        for name in re.findall(r"^from tlpsim\.loads\.bem\.(\w+) import", waiting.pop().read_text(), re.MULTILINE):
            if f"{name}.py" not in found:
                found.add(f"{name}.py")
                waiting.append(path.with_name(f"{name}.py"))
    return found


def test_key_depends_on_all_that_numbers_come_from() -> None:
    """Every module that the database imports counts, but those that only hand numbers on."""
    handing_on = {"hydrostatics.py", "green.py"}
    assert imports(Path(str(database.__file__))) - handing_on <= set(database._SOLVER)


def test_unchanged_problem_is_not_solved_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, int]] = []
    first = cached(PROBLEM, tmp_path, lambda done, total: seen.append((done, total)))
    assert seen == [(1, 2), (2, 2)]
    monkeypatch.setattr(database, "compute", lambda *_: pytest.fail("solved again"))
    second = cached(replace(PROBLEM, mesh=replace(PROBLEM.mesh, name="other name")), tmp_path)
    np.testing.assert_array_equal(first.added_mass, second.added_mass)


def test_damaged_cache_is_made_again(tmp_path: Path) -> None:
    path = cache_path(PROBLEM, tmp_path)
    path.write_bytes(b"half a file")
    assert_equal(cached(PROBLEM, tmp_path), read(path))


def test_cache_that_cannot_be_written_is_only_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.warns(UserWarning, match="cannot be written"):
        found = cached(PROBLEM, tmp_path / "file" / "cache")
    assert_equal(found, compute(PROBLEM))


def test_interrupted_computation_leaves_nothing(tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cached(PROBLEM, tmp_path, interrupt)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "change",
    [
        {"depth": np.inf},
        {"density": 1000.0},
        {"gravity": 9.81},
        {"omega": np.array([0.5, 1.1])},
        {"heading": np.array([0.0])},
        {"mesh": box(2.0, 1.0, 0.5, 0.25)},
        {"mesh": replace(PROBLEM.mesh, planes=())},
        {"lid": PROBLEM.mesh},
        {"mass": np.eye(6)},
        {"stiffness": np.eye(6)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_key_tells_problems_apart(change: dict[str, object]) -> None:
    assert problem_key(replace(PROBLEM, **change)) != problem_key(PROBLEM)  # type: ignore[arg-type]


def test_key_tells_solvers_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    before = problem_key(PROBLEM)
    monkeypatch.setattr(database, "_solver_digest", lambda: "another solver")
    assert problem_key(PROBLEM) != before


def test_bad_problems_and_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="ascend"):
        compute(replace(PROBLEM, omega=np.array([1.0, 0.5])))
    with pytest.raises(ScenarioError, match="both"):
        compute(replace(PROBLEM, mass=np.eye(6)))
    with pytest.raises(ScenarioError, match="not a hydrodynamic database"):
        read(tmp_path / "missing.h5")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    assert not is_database(tmp_path / "other.h5")
    assert not is_database(tmp_path / "missing.h5")
    with pytest.raises(ScenarioError, match="schema"):
        read(tmp_path / "other.h5")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ScenarioError, match="cannot be written"):
        write(compute(PROBLEM), tmp_path / "folder")
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize(("version", "remedy"), [("1", "compute it again"), ("99", "newer tlpsim")])
def test_another_schema_is_refused_with_its_remedy(tmp_path: Path, version: str, remedy: str) -> None:
    path = tmp_path / "hydro.h5"
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = f"tlpsim hydrodynamic database {version}"
    assert is_database(path)
    with pytest.raises(ScenarioError, match=remedy):
        read(path)


def test_extrapolated_hemisphere_lies_within_its_error_bars(tmp_path: Path) -> None:
    """Against the multipole series, and the half of the displaced mass for heave at infinite frequency."""
    numbers = np.array([0.3, 0.6, 1.2])  # K a
    problem = Problem(
        mesh=hemisphere(1.0, 8, 8),
        coarse=hemisphere(1.0, 4, 4),
        omega=np.sqrt(9.80665 * numbers),
        heading=np.zeros(1),
        mass=2e3 * np.eye(6),
        stiffness=1e4 * np.eye(6),
    )
    found = compute(problem)
    mass = 1025.0 * 2.0 / 3.0 * np.pi
    for index, number in enumerate(numbers):
        for mode, order in ((0, 1), (2, 0)):
            exact_mass, exact_damping = (mass * value for value in hemisphere_coefficients(order, float(number)))
            bar = found.error["added_mass"][index, mode, mode], found.error["radiation_damping"][index, mode, mode]
            assert abs(found.added_mass[index, mode, mode] - exact_mass) < bar[0]
            assert abs(found.radiation_damping[index, mode, mode] - exact_damping * found.omega[index]) < bar[1]
            # Nor are the bars so wide as to hold anything: panels of an eighth of a quadrant are within some per cent.
            assert bar[0] < 0.05 * exact_mass
    assert abs(found.added_mass_infinite[2, 2] - 0.5 * mass) < found.error["added_mass_infinite"][2, 2]
    assert set(found.error) == set(ERROR_BARS)
    write(found, tmp_path / "hull.h5")
    again = read(tmp_path / "hull.h5")
    for name, bar in found.error.items():
        np.testing.assert_array_equal(again.error[name], bar)


def test_an_infinite_limit_stays_infinite() -> None:
    """A33 at zero frequency in water of finite depth."""
    value, error = limit_where_finite(np.array([1.0, np.inf]), np.array([1.2, np.inf]))
    assert value[1] == np.inf
    assert np.isnan(error[1])
    assert np.isfinite([value[0], error[0]]).all()


def test_vertical_drift_goes_into_the_database() -> None:
    """Six components, of which surge and sway are those of the far field (all have tests of their own)."""
    problem = Problem(mesh=hemisphere(1.0, 6, 6), omega=np.array([3.0]), heading=np.array([0.3]))
    far, near = compute(problem).mean_drift, compute(replace(problem, vertical_drift=True)).mean_drift
    assert (far.shape, near.shape) == ((1, 1, 3), (1, 1, 6))
    np.testing.assert_allclose(near[0, 0, :2], far[0, 0, :2], rtol=0.02)
    assert problem_key(problem) != problem_key(replace(problem, vertical_drift=True))
