"""What several jobs need and one task makes: hydrodynamics of a hull, fits of digital filters, files of the scenario.

Each is a task of its own on the cluster, named by the hash of all that it depends on; Dask carries its result to the
workers whose jobs need it, and makes it again where a worker was lost. `at_hand` puts it to use in a worker.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import platformdirs
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.filters.arma import Fit
from tlpsim.loads.filters.known_fits import fits_used, learn
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.reading import merge
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import BUILTIN
from tlpsim.scenarios.sweep.identity import KEY_LENGTH, digest, file_digest, named_files

# Keys of `[waves]` and `[wind]` that no fit depends on.
_WAVES = {"heading_deg", "directions", "spreading_exponent", "seed", "components", "displaced_position", "drift"} | {
    "quadratic_transfer",
    "drift_damping",
    "splash",
    "stretching",
}
_WIND = {"seed"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """What a task made.

    Attributes
    ----------
    fits
        Of digital filters, by all that they depend on.
    name, content
        Of a file: its place in the user's cache (hydrodynamics), or the path that the scenario names; "" for none.
    digest
        Of the content of a file that the scenario names; "" of hydrodynamics.
    """

    fits: Mapping[Hashable, Fit]
    name: str = ""
    content: bytes = b""
    digest: str = ""


def at_hand(scenario: Scenario, prepared: Sequence[Prepared]) -> Scenario:
    """The scenario, all of whose files are here, in a process that knows the fits."""
    moved: dict[str, str] = {}
    for each in prepared:
        learn(each.fits)
        if not each.name:
            continue
        if each.digest:
            moved[each.name] = str(_file_here(each))
        else:
            _put(platformdirs.user_cache_path("tlpsim") / "bem" / each.name, each.content)
    changes = _renamed(scenario, {name: path for name, path in moved.items() if name != path})
    return scenario.changed(changes, "sweep") if changes else scenario


def _file_here(file: Prepared) -> Path:
    """Path of a named file: its own where that has the same content, or a copy in the user's cache."""
    own = Path(file.name)
    if own.is_file() and file_digest(own) == file.digest:
        return own
    copy = platformdirs.user_cache_path("tlpsim") / "inputs" / file.digest / own.name
    _put(copy, file.content)
    return copy


def _put(path: Path, content: bytes) -> None:
    if not path.exists():
        with whole_file(path, "a file of the sweep") as part:
            part.write_bytes(content)


def _renamed(scenario: Scenario, moved: Mapping[str, str]) -> dict[str, Any]:
    """Settings that name files where they are."""
    changes: dict[str, Any] = {}
    for name, entry in scenario.components.items():
        if entry.fmu in moved:
            changes = merge(changes, {"components": {name: {"fmu": moved[entry.fmu]}}})
    if scenario.platform.hydrodynamics in moved:
        changes = merge(changes, {"platform": {"hydrodynamics": moved[scenario.platform.hydrodynamics]}})
    if (table := scenario.waves.quadratic_transfer) in moved and table is not None:
        changes = merge(changes, {"waves": {"quadratic_transfer": moved[table]}})
    return changes


# Hydrodynamics


def hydrodynamics_key(scenario: Scenario) -> str:
    """Key of the hydrodynamics that a scenario's built-in components compute; "" where they compute none."""
    platform, site = scenario.platform, scenario.site
    own = any(entry.fmu in (f"{BUILTIN}wave", f"{BUILTIN}platform") for entry in scenario.components.values())
    if platform.hydrodynamics != platform.model or not own:
        return ""
    from tlpsim.scenarios.parameters import hull_text

    return f"hydrodynamics-{digest(site.water_depth, site.water_density, site.gravity, hull_text(scenario))}"


def prepare_hydrodynamics(scenario: str) -> Prepared:
    """Compute the hydrodynamics of a scenario (JSON), or take them from this host's cache."""
    from tlpsim.loads.bem.database import cache_path, cached
    from tlpsim.scenarios.parameters import hydrodynamic_problem

    problem = hydrodynamic_problem(Scenario.from_json(scenario))
    with threadpool_limits(1):
        cached(problem)
    path = cache_path(problem)
    return Prepared(fits={}, name=path.name, content=path.read_bytes())


# Fits


def fit_keys(scenario: Scenario) -> dict[str, str]:
    """Keys of the fits that a run of a scenario needs, by which of wind and waves they are of."""
    found = {}
    waves, wind = scenario.components.get("wave"), scenario.components.get("wind")
    if waves is not None and waves.fmu == f"{BUILTIN}wave" and scenario.waves.generator == "arma":
        content = scenario.waves.model_dump(mode="json", exclude=_WAVES)
        site = scenario.site.model_dump(mode="json", include={"water_depth", "gravity"})
        found["wave"] = f"elevation-{digest(content, site, dict(waves.parameters))}"
    if wind is not None and wind.fmu == f"{BUILTIN}wind":
        content = scenario.wind.model_dump(mode="json", exclude=_WIND)
        found["wind"] = f"gusts-{digest(content, dict(wind.parameters))}"
    return found


def prepare_fits(which: str, scenario: str, *prepared: Prepared) -> Prepared:
    """Fit the filters of the wind or of the waves of a scenario (JSON), with what was prepared for it."""
    from tlpsim.scenarios.assemble import wave_loads, wind_loads

    found = at_hand(Scenario.from_json(scenario), prepared)
    with fits_used() as fits, threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the jobs tell them
        wind_loads(found) if which == "wind" else wave_loads(found)
    return Prepared(fits=fits)


# Files


def prepare_file(name: str, content: bytes) -> Prepared:
    """A file that scenarios name, with its content."""
    return Prepared(fits={}, name=name, content=content, digest=hashlib.sha256(content).hexdigest()[:KEY_LENGTH])


def file_keys(scenario: Scenario) -> dict[Path, str]:
    """Keys of the files that a scenario names, by their paths.

    Raises
    ------
    ScenarioError
        When one cannot be read.
    """
    return {path: f"file-{digest(str(path), file_digest(path))}" for path in named_files(scenario)}
