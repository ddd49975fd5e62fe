"""What `--json` prints of results, systems, FMUs, hydrodynamics and a response: nested mappings of plain values.

Numbers are in SI units, angles in rad, where a field `unit` says nothing else. The field `kind` says what it is. What
is not known is NaN here, and null in the text that `tlpsim.scenarios.json_text.json_text` makes. The comparison and the
sensitivity study have theirs in `tlpsim.scenarios.compare` and `tlpsim.scenarios.sensitivity_output`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.orchestrator.system import loops

if TYPE_CHECKING:
    from tlpsim.loads.bem.database import HydrodynamicDatabase
    from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer
    from tlpsim.loads.spectral.records import SpectralResponse
    from tlpsim.orchestrator.coupling_report import ConnectionReport
    from tlpsim.orchestrator.fmi.description import FmuDescription
    from tlpsim.orchestrator.system import System
    from tlpsim.scenarios.results import Results
    from tlpsim.scenarios.swap import Swap

Content = dict[str, Any]


def record_content(record: Any) -> Content:
    """Fields of a record by name."""
    return {each.name: getattr(record, each.name) for each in fields(record)}


def plain(value: Any) -> Any:
    """A number or text of HDF5 or numpy as one of Python, an array as a list."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


# Results


def results_content(results: Results, notes: Sequence[str] = ()) -> Content:
    """What a results file holds, and what the run comes to; `notes` stand before those of the statistics."""
    attributes = results.attributes
    found = _summary(results) if results.has_scenario else {"outputs": _outputs(results), "notes": []}
    return {
        "kind": "results",
        "path": str(results.path),
        "title": results.title,
        "status": results.status,
        "created": str(attributes.get("created", "")),
        "wall_time": float(attributes.get("wall_time", np.nan)),
        "seeds": results.seeds,
        "versions": results.versions,
        **found,
        "notes": [*notes, *found["notes"]],
        "coupling": [record_content(each) for each in results.coupling],
        "components": [_component(results, name) for name in results.components],
    }


def _component(results: Results, name: str) -> Content:
    signals = [f"{name}.{variable}" for variable in results.signals(name)]
    return {
        "name": name,
        **{key: plain(value) for key, value in results.components[name].items()},
        "samples": len(results.time(name)),
        "signals": [
            {"name": each, "unit": results.unit(each), "description": results.description(each)} for each in signals
        ],
    }


def _summary(results: Results) -> Content:
    """Response by degree of freedom, in SI units and not in those of the table."""
    from tlpsim.scenarios.results import ResultsError
    from tlpsim.scenarios.statistics.summary import TABLE_UNITS, summary

    try:
        found = summary(results)
    except ResultsError as error:  # of a run that ended before its second sample
        return {"evaluated": "", "summary": [], "tension": None, "notes": [str(error)]}
    numbers = ("mean", "low_frequency", "wave_frequency", "std", "minimum", "maximum")
    rows = []
    for row in found.motions:
        unit, factor = TABLE_UNITS[row.name]
        si = {number: getattr(row, number) / factor for number in numbers}
        rows.append({"name": row.name, "unit": "rad" if unit.endswith("rad") else "m", **si})
    tensions = None if found.tensions is None else {"unit": "N", **record_content(found.tensions)}
    return {"evaluated": found.description, "summary": rows, "tension": tensions, "notes": list(found.notes)}


def _outputs(results: Results) -> list[Content]:
    """Statistics of each output of a system without a scenario over the whole run, in its own unit."""
    rows = []
    for component in results.components:
        for name in (f"{component}.{variable}" for variable in results.signals(component)):
            values = results.signal(name) if len(results.time(component)) else np.array([np.nan])
            found = {what: float(getattr(values, how)()) for what, how in _STATISTICS.items()}
            rows.append({"name": name, "unit": results.unit(name), **found})
    return rows


_STATISTICS = {"mean": "mean", "std": "std", "minimum": "min", "maximum": "max"}  # and their names in numpy


# Systems and FMUs


def system_content(title: str, system: System, notes: Sequence[str], origins: Mapping[str, str]) -> Content:
    """Components, connections and loops of a system."""
    return {
        "kind": "system",
        "title": title,
        "components": [
            {
                "name": each.name,
                "fmu": origins[each.name],
                "step": to_seconds(each.step),
                "inputs": sum(variable.causality == "input" for variable in each.instance.variables.values()),
                "outputs": sum(variable.causality == "output" for variable in each.instance.variables.values()),
            }
            for each in system.components
        ],
        "connections": [
            {
                "from": f"{each.source}.{each.source_variable}",
                "to": f"{each.target}.{each.target_variable}",
                "filter": each.filter,
                "extrapolation": each.extrapolation,
                "factor": each.factor,
                "offset": each.offset,
            }
            for each in system.connections
        ],
        "loops": [sorted(loop) for loop in loops(system)],
        "notes": list(notes),
    }


def coupling_content(reports: Sequence[ConnectionReport]) -> list[Content]:
    """What `--coupling` says of each connection before a run."""
    return [record_content(each) for each in reports]


def fmu_content(description: FmuDescription) -> Content:
    """Identity and variables of an FMU."""
    return {
        "kind": "FMU",
        "path": str(description.path),
        "model_name": description.model_name,
        "fmi_version": description.fmi_version,
        "interfaces": list(description.kinds),
        "capabilities": dict(description.capabilities),
        "generation_tool": description.generation_tool,
        "sha256": description.sha256,
        "default_experiment": dict(description.default_experiment),
        "variables": [
            {
                "name": each.name,
                "causality": each.causality,
                "variability": each.variability,
                "type": each.type,
                "unit": each.unit or "",
                "start": each.start,
                "description": each.description,
            }
            for each in description.variables.values()
        ],
    }


def swap_content(found: Swap) -> Content:
    """Whether an FMU fits, variable by variable, and the keys of a scenario that put it there."""
    return {
        "kind": "swap",
        "component": found.name,
        "fmu": str(found.fmu.path),
        "fits": not found.faults,
        "errors": list(found.faults),
        "notes": list(found.notes),
        "variables": [{**record_content(each), "fits": each.fits} for each in found.fits],
        "other_inputs": list(found.extra),
        "changes": dict(found.changes),
        "toml": found.snippet,
    }


# Hydrodynamics


def database_content(database: HydrodynamicDatabase) -> Content:
    """Water, hull, and the diagonals of added mass and radiation damping with their error bars."""
    still, mesh, error = database.hydrostatics, database.mesh, database.error
    peaks = np.argmax(np.einsum("wii->wi", database.radiation_damping), axis=0)
    modes = []
    for k, (name, peak) in enumerate(zip(DEGREES_OF_FREEDOM, peaks, strict=True)):
        modes.append(
            {
                "name": name,
                "added_mass_zero": float(database.added_mass_zero[k, k]),
                "added_mass_infinite": float(database.added_mass_infinite[k, k]),
                "added_mass_infinite_error": float(error["added_mass_infinite"][k, k]) if error else np.nan,
                "largest_radiation_damping": float(database.radiation_damping[peak, k, k]),
                "largest_radiation_damping_error": float(error["radiation_damping"][peak, k, k]) if error else np.nan,
                "largest_radiation_damping_omega": float(database.omega[peak]),
            }
        )
    return {
        "kind": "hydrodynamic database",
        **_water(database),
        "panels": None if mesh is None else mesh.panel_count,
        "volume": np.nan if still is None else float(still.volume),
        "centre_of_buoyancy": None if still is None else [float(each) for each in still.centre_of_buoyancy],
        "waterplane_area": np.nan if still is None else float(still.waterplane_area),
        "modes": modes,
    }


def quadratic_content(table: QuadraticTransfer) -> Content:
    """Water, contents, and the largest values of a difference-frequency quadratic transfer function."""
    from tlpsim.loads.bem.quadratic_transfer import largest_values, mean_drift_of

    drift = np.max(np.abs(mean_drift_of(table)), axis=(0, 1))
    return {
        "kind": "quadratic transfer function",
        **_water(table),
        "pairs_of_headings": table.transfer.ndim == 5,
        "contents": table.contents,
        "modes": [
            {"name": name, "largest_transfer": float(largest), "largest_mean_drift": float(mean)}
            for name, largest, mean in zip(DEGREES_OF_FREEDOM, largest_values(table), drift, strict=True)
        ],
    }


def _water(of: HydrodynamicDatabase | QuadraticTransfer) -> Content:
    known = {name: float(getattr(of, name)) for name in ("depth", "density", "gravity")}
    return {
        "deep_water": bool(np.isposinf(of.depth)),
        **known,
        "omega": of.omega.tolist(),
        "heading": of.heading.tolist(),
    }


# The frequency domain


def response_content(response: SpectralResponse, title: str, duration: float) -> Content:
    """Statistics of every quantity for records of a duration (s), natural modes, mean loads, time taken."""
    from tlpsim.scenarios.spectral_tables import quantity_statistics

    quantities = []
    for name, each in response.quantities.items():
        shape = {"skewness": float(each.skewness), "excess_kurtosis": float(each.excess_kurtosis)}
        found = record_content(quantity_statistics(each, duration))
        quantities.append({"name": name, "unit": each.unit, **found, **shape})
    return {
        "kind": "spectral response",
        "title": title,
        "duration": duration,
        "quantities": quantities,
        "modes": [record_content(each) for each in response.modes],
        "mean_loads": {name: plain(load) for name, load in response.mean_loads.items()},
        "outer_rounds": [float(each) for each in response.iterations],
        "seconds": {name: float(each) for name, each in response.seconds.items()},
    }
