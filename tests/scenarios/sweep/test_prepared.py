"""What jobs share: what each depends on, and its use in a process that did not make it."""

import pickle
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tlpsim.loads.bem import database
from tlpsim.loads.bem.issc import issc_problem
from tlpsim.loads.filters import known_fits
from tlpsim.loads.waves import elevation
from tlpsim.loads.wind import field
from tlpsim.scenarios.parameters import scenario_hull
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sweep.identity import case_key, file_digest, program_version
from tlpsim.scenarios.sweep.job import Order, Place, perform
from tlpsim.scenarios.sweep.prepared import (
    Prepared,
    at_hand,
    file_keys,
    fit_keys,
    hydrodynamics_key,
    prepare_file,
    prepare_fits,
    prepare_hydrodynamics,
)
from tlpsim.scenarios.sweep.sections import Statistics


@pytest.fixture(autouse=True)
def nothing_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that has made no fit."""
    monkeypatch.setattr(known_fits, "_fits", OrderedDict())


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's cache, empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "tlpsim"


@pytest.fixture(scope="module")
def windy(quick: Scenario) -> Scenario:
    """20 s of wind and waves, whose filters are small."""
    orders = {"long": 12, "autoregressive": 2, "moving_average": 1}
    changes: dict[str, Any] = {
        "simulation": {"duration": 20.0},
        "wind": {"speed": 20.0, "orders": {"long": 10, "autoregressive": 2, "moving_average": 2}, "seed": 3},
        "waves": {"orders": orders, "sampling_step": 1.0, "seed": 4},
    }
    components = {"wind": {"fmu": "builtin:wind", "step": 1.0}}
    wires: dict[str, Any] = {
        "platform.wind_force.*": {"from": "wind.force.*"},
        "wind.velocity.*": {"from": "platform.velocity.*"},
        "wind.position.yaw": {"from": "platform.position.yaw"},
    }
    return quick.with_(**changes, components=components, connections=wires)


def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Know no fit, and make none."""

    def fail(*arguments: object) -> None:
        raise AssertionError("a fit is made")

    monkeypatch.setattr(known_fits, "_fits", OrderedDict())
    monkeypatch.setattr(elevation, "_fitted", fail)
    monkeypatch.setattr(field, "_fitted", fail)


def order_of(scenario: Scenario, engine: Any = "monolithic") -> Order:
    return Order(
        key="a",
        domain="time",
        scenario=scenario.to_json(),
        statistics=Statistics(signals=("platform.position.*",)),
        engine=engine,
        file="",
        place=Place(folder="/none", token=""),
        version=program_version(),
    )


# Fits


@pytest.mark.parametrize("engine", ["monolithic", "cosimulation"])
def test_fits_are_carried_and_not_made_again(engine: str, windy: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    order = order_of(windy, engine)
    alone = perform(order)
    assert alone.error == ""
    monkeypatch.setattr(known_fits, "_fits", OrderedDict())
    made = [prepare_fits(which, windy.to_json()) for which in fit_keys(windy)]
    assert sum(len(each.fits) for each in made) == 2
    carried = pickle.loads(pickle.dumps(made))
    forget(monkeypatch)
    assert "a fit is made" in perform(order).error
    assert "a fit is made" in perform(order, carried[0]).error
    found = perform(order, *carried)
    assert found.error == ""
    assert found.names == alone.names
    assert found.values.tobytes() == alone.values.tobytes()


def test_another_seed_uses_the_same_fits(windy: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    other = windy.with_(wind={"seed": 8}, waves={"seed": 9, "heading_deg": 40.0})
    assert fit_keys(other) == fit_keys(windy)
    made = [prepare_fits(which, windy.to_json()) for which in fit_keys(windy)]
    forget(monkeypatch)
    assert perform(order_of(other), *made).error == ""


CHANGES: list[dict[str, Any]] = [
    {"simulation": {"duration": 30.0, "seed": 5}},
    {"site": {"water_depth": 300.0}},
    {"site": {"gravity": 9.7}},
    {"site": {"water_density": 1000.0}},
    {"site": {"air_density": 1.0}},
    {"platform": {"draught": 34.0}},
    {"platform": {"drag_coefficient": 1.0}},
    {"wind": {"seed": 9}},
    {"wind": {"speed": 21.0}},
    {"wind": {"heading_deg": 3.0}},
    {"wind": {"profile": "power"}},
    {"wind": {"roughness": 0.002}},
    {"wind": {"spectrum": "harris"}},
    {"wind": {"coherence": {"vertical": 9.0}}},
    {"wind": {"admittance": "davenport"}},
    {"wind": {"decomposition": "linear"}},
    {"wind": {"sampling_step": 0.5}},
    {"wind": {"orders": {"long": 11}}},
    {"wind": {"segments": [{"position": [0, 0, 10], "area": 100, "shape_coefficient": 1}]}},
    {"waves": {"seed": 9}},
    {"waves": {"heading_deg": 3.0}},
    {"waves": {"directions": 3, "spreading_exponent": 4.0}},
    {"waves": {"components": 30}},
    {"waves": {"displaced_position": False}},
    {"waves": {"drift": "newman"}},
    {"waves": {"drift_damping": False}},
    {"waves": {"splash": False}},
    {"waves": {"stretching": "wheeler"}},
    {"waves": {"spectrum": "jonswap"}},
    {"waves": {"significant_height": 5.0}},
    {"waves": {"peak_period": 12.0}},
    {"waves": {"frequency_max": 0.3}},
    {"waves": {"sampling_step": 0.9}},
    {"waves": {"orders": {"autoregressive": 3}}},
    {"waves": {"table": {"frequency": [0.05, 0.1, 0.2], "density": [1.0, 2.0, 1.0]}}},
    {"current": {"speed": 1.0}},
    {"current": {"speed": 1.0, "doppler": True}},
    {"components": {"wave": {"step": 1.0}, "wind": {"step": 2.0}}},
    {"components": {"wave": {"parameters": {"waves.significant_height": 3.0}}}},
]


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_fits_of_one_key_are_the_same(change: dict[str, Any], windy: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scenario has the key of another one only where a run of it asks for no other fits."""
    monkeypatch.setattr(elevation, "_fitted", known(elevation._fitted))
    monkeypatch.setattr(field, "_fitted", known(field._fitted))
    try:
        other = windy.with_(**change)
    except Exception as error:
        pytest.fail(f"the change is no scenario: {error}")
    for which, key in fit_keys(windy).items():
        if fit_keys(other)[which] == key:
            wanted, found = (set(prepare_fits(which, each.to_json()).fits) for each in (windy, other))
            assert found == wanted


_KNOWN: dict[str, Any] = {}


def known(fitted: Callable[..., Any]) -> Callable[..., Any]:
    """Any fit will do where only its key is looked at."""

    def any_fit(*arguments: object) -> Any:
        name = fitted.__module__
        if name not in _KNOWN:
            _KNOWN[name] = fitted(*arguments)
        return _KNOWN[name]

    return any_fit


def test_no_fits_where_none_are_made(quick: Scenario) -> None:
    assert set(fit_keys(quick)) == {"wave"}
    assert fit_keys(quick.with_(waves={"generator": "harmonic"})) == {}


# Files


def with_files(folder: Path, scenario: Scenario) -> Scenario:
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("b.h5", "q.h5", "wind.csv"):
        (folder / name).write_text(f"content of {name}")
    return scenario.with_(
        platform={"hydrodynamics": str(folder / "b.h5")},
        waves={"drift": "qtf", "quadratic_transfer": str(folder / "q.h5")},
        components={"table": {"fmu": str(folder / "wind.csv"), "step": 1.0}},
    )


def files_of(scenario: Scenario) -> list[Prepared]:
    return [prepare_file(str(path), path.read_bytes()) for path in file_keys(scenario)]


def named(scenario: Scenario) -> list[Path]:
    return [Path(name) for name in file_names(scenario)]


def file_names(scenario: Scenario) -> list[str]:
    assert scenario.waves.quadratic_transfer is not None
    return [scenario.components["table"].fmu, scenario.platform.hydrodynamics, scenario.waves.quadratic_transfer]


def test_files_that_are_here_stay_where_they_are(tmp_path: Path, quick: Scenario, cache: Path) -> None:
    scenario = with_files(tmp_path / "a", quick)
    assert at_hand(scenario, files_of(scenario)) is scenario
    assert not cache.exists()


@pytest.mark.parametrize("there", ["nothing", "another"])
def test_files_of_another_host_are_found_by_content(there: str, tmp_path: Path, quick: Scenario, cache: Path) -> None:
    scenario = with_files(tmp_path / "a", quick)
    key, prepared = case_key(scenario), pickle.loads(pickle.dumps(files_of(scenario)))
    for path in named(scenario):
        path.unlink()
        if there == "another":
            path.write_text("other content under the same name")
    moved = at_hand(scenario, prepared)
    assert [path.read_text() for path in named(moved)] == [f"content of {path.name}" for path in named(scenario)]
    assert all(path.is_relative_to(cache) for path in named(moved))
    assert case_key(moved) == key
    stamps = [path.stat().st_mtime_ns for path in named(moved)]
    assert at_hand(scenario, prepared) == moved
    assert [path.stat().st_mtime_ns for path in named(moved)] == stamps


def test_files_of_one_name_are_apart(tmp_path: Path, quick: Scenario, cache: Path) -> None:
    first = with_files(tmp_path / "a", quick)
    second = with_files(tmp_path / "b", quick)
    (tmp_path / "b" / "b.h5").write_text("second")
    prepared = [*files_of(first), *files_of(second)]
    for path in (*named(first), *named(second)):
        path.unlink()
    moved = [at_hand(each, prepared).platform.hydrodynamics for each in (first, second)]
    assert [Path(name).read_text() for name in moved] == ["content of b.h5", "second"]


def test_keys_of_files_are_of_path_and_content(tmp_path: Path, quick: Scenario) -> None:
    first, second = with_files(tmp_path / "a", quick), with_files(tmp_path / "b", quick)
    keys = {*file_keys(first).values(), *file_keys(second).values()}
    assert len(keys) == 6
    (tmp_path / "a" / "b.h5").write_text("longer than it was")
    assert len({*file_keys(first).values()} - keys) == 1
    assert file_keys(quick) == {}
    for each in files_of(first):
        assert each.digest == file_digest(Path(each.name))


# Hydrodynamics


@pytest.mark.parametrize(
    "change",
    [
        {"wind.speed": 1.0},
        {"waves.peak_period": 11.0},
        {"simulation.seed": 3},
        {"platform.radiation": "none"},
        {"platform.drag_coefficient": 1.0},
        {"platform.mass": 41e6},
        {"platform.draught": 34.0},
        {"platform.yaw_inertia": 99e9},
        {"platform.tendons.axial_stiffness": 3e11},
        {"site.water_depth": 300.0},
        {"site.water_density": 1000.0},
        {"site.air_density": 1.0},
        {"site.gravity": 9.7},
    ],
    ids=str,
)
def test_hydrodynamics_of_one_key_are_one_file(change: dict[str, Any]) -> None:
    scenarios = (Scenario(), Scenario().with_(**change))
    paths = [
        database.cache_path(
            issc_problem(each.site.water_depth, each.site.water_density, each.site.gravity, scenario_hull(each))
        )
        for each in scenarios
    ]
    keys = [hydrodynamics_key(each) for each in scenarios]
    assert keys[0].startswith("hydrodynamics-")
    assert (keys[0] == keys[1]) is (paths[0] == paths[1])


def test_no_hydrodynamics_where_none_are_computed(tmp_path: Path, quick: Scenario) -> None:
    assert hydrodynamics_key(quick) == ""
    assert hydrodynamics_key(with_files(tmp_path, quick)) == ""
    alone = {"wind": {"fmu": "builtin:wind", "step": 1.0}, "wave": {"fmu": ""}, "platform": {"fmu": ""}}
    assert hydrodynamics_key(Scenario().with_(components=alone)) == ""


def test_hydrodynamics_come_to_the_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solved = []

    def solve(problem: Any) -> None:
        solved.append(problem)
        path = database.cache_path(problem)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"the database")

    monkeypatch.setattr(database, "cached", solve)
    scenario = Scenario()
    prepared = pickle.loads(pickle.dumps(prepare_hydrodynamics(scenario.to_json())))
    path = database.cache_path(solved[0])
    assert path.is_relative_to(cache)
    assert (prepared.name, prepared.content, prepared.digest) == (path.name, b"the database", "")
    path.unlink()
    assert at_hand(scenario, [prepared]) is scenario
    assert path.read_bytes() == b"the database"
    path.write_bytes(b"its own")
    at_hand(scenario, [prepared])
    assert path.read_bytes() == b"its own"
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_values_of_the_scenario_are_as_they_were(tmp_path: Path, quick: Scenario, cache: Path) -> None:
    scenario = with_files(tmp_path / "a", quick)
    prepared = files_of(scenario)
    for path in named(scenario):
        path.unlink()
    moved, settings = at_hand(scenario, prepared).model_dump(), scenario.model_dump()
    moved["platform"]["hydrodynamics"] = settings["platform"]["hydrodynamics"]
    moved["waves"]["quadratic_transfer"] = settings["waves"]["quadratic_transfer"]
    moved["components"]["table"]["fmu"] = settings["components"]["table"]["fmu"]
    assert moved == settings
    assert np.isfinite(moved["waves"]["peak_period"])
