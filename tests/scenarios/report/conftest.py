"""Results for reports: files written by hand after the documented layout, and a short storm."""

import json
from collections.abc import Callable, Mapping
from typing import Any

import h5py
import numpy as np
import pytest

from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

STEP = 0.5


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Results]:
    """Maker of results from signals by full name, with their units; a step of 0.5 s where nothing else is said."""
    folder = tmp_path_factory.mktemp("written")

    def make(
        signals: Mapping[str, np.ndarray],
        units: Mapping[str, str] | None = None,
        scenario: Scenario | None = None,
        name: str = "",
        **attributes: Any,
    ) -> Results:
        path = folder / (name or f"{len(list(folder.iterdir()))}.h5")
        with h5py.File(path, "w", track_order=True) as file:
            file.attrs.update({"format": "tlpsim results", "schema_version": 2, "created": "2026-01-02T03:04:05+00:00"})
            file.attrs.update({"title": "By hand", "versions": json.dumps({"tlpsim": "0.1.0"}), "status": "complete"})
            if scenario is None:
                file.attrs["system"] = "{}"
            else:
                file.attrs.update({"scenario": scenario.to_json(), "seeds": json.dumps(scenario.seeds())})
            file.attrs.update(attributes)
            for full, values in signals.items():
                component, variable = full.split(".", 1)
                group = file.require_group(component)
                group.attrs["step"] = STEP
                if "time" not in group:
                    group["time"] = np.arange(len(values)) * STEP
                group[variable] = values
                unit = (units or {}).get(full, "")
                group[variable].attrs.update({"variable": variable, "units": unit, "long_name": f"what {variable} is"})
        return open_results(path)

    return make


@pytest.fixture(scope="session")
def storm() -> Scenario:
    """The default storm for 400 s, of which the last 300 s count."""
    return Scenario().with_(simulation={"duration": 400.0}, outputs={"statistics_from": 100.0})


@pytest.fixture(scope="session")
def record(storm: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A record of it."""
    return run_scenario(storm, tmp_path_factory.mktemp("storm") / "storm.h5", monolithic=True)
