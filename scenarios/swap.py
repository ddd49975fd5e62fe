"""`tlpsim swap`: whether an FMU can take a component's place, and the lines of a scenario that put it there.

The reference is the table of variables of the project's own component of that name (docs/fmu-contract.md), and the
scenario's wiring says which of them must be there. A vendor's variable of another name is found by what it is, see
`tlpsim.scenarios.matching`; what is found so is a proposal, marked with ?.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from tlpsim.fmus.component import Variable as Row
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import FmuError, ScenarioError
from tlpsim.orchestrator.fmi.description import CO_SIMULATION, FmuDescription, library_member, read_description
from tlpsim.orchestrator.units import defined, unit_conversion
from tlpsim.scenarios.assemble import OPTIONAL
from tlpsim.scenarios.matching import find_matches
from tlpsim.scenarios.monolithic import COMPONENTS
from tlpsim.scenarios.parameters import STANDARD
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.reading import merge, read_toml
from tlpsim.scenarios.schema import Scenario, with_absolute_paths
from tlpsim.scenarios.terminal import output
from tlpsim.scenarios.writing import to_toml


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A variable of the contract and what a vendor has for it.

    Parameters
    ----------
    variable
        Name in the contract.
    causality
        ``input`` or ``output``.
    needed
        Whether the scenario connects it.
    match
        The vendor's name, "" where there is none.
    exact
        Whether it is the contract's own.
    unit
        What becomes of the unit, for people.
    convertible
        Whether the wiring converts it.
    factor
        Where it does not, that by which it would if an angle had no unit; None where even then it cannot.
    """

    variable: str
    causality: str
    needed: bool
    match: str
    exact: bool
    unit: str = ""
    convertible: bool = True
    factor: float | None = None

    @property
    def fits(self) -> bool:
        """Whether nothing of it stands in the way of a run."""
        return (bool(self.match) and (self.convertible or self.factor is not None)) or not self.needed


@dataclass(frozen=True, slots=True, kw_only=True)
class Swap:
    """Whether an FMU fits in the place of a component, and how.

    Parameters
    ----------
    name
        Of the component.
    fmu
        The vendor's.
    fits
        A record for each input and output of the contract.
    extra
        Inputs of the vendor that the contract does not have.
    faults, notes
        What is in the way of a run, and what is not.
    changes
        Keys of a scenario that put the FMU there.
    """

    name: str
    fmu: FmuDescription
    fits: tuple[Fit, ...]
    extra: tuple[str, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    changes: Mapping[str, Any]

    @property
    def snippet(self) -> str:
        """The changes as TOML."""
        return to_toml(self.changes)


def swap(scenario: Scenario, name: str, path: str | Path) -> Swap:
    """Check an FMU against the contract of the component that it is to replace.

    Parameters
    ----------
    scenario
        Whose wiring says what is needed.
    name
        Of the component: wind, wave or platform.
    path
        Of the vendor's FMU.

    Raises
    ------
    ScenarioError
        If there is no contract of that name, or the scenario has no such component.
    FmuError
        If the FMU cannot be read.
    """
    if name not in COMPONENTS or name not in scenario.components:
        known = [each for each in COMPONENTS if each in scenario.components]
        raise ScenarioError(
            f"swap: there is no contract of a component '{name}'{nearest(name, known)}: {', '.join(known)}"
        )
    fmu = read_description(path)
    table = [row for row in COMPONENTS[name].table if row.causality in ("input", "output")]
    used = {
        (end, variable)
        for wire in scenario.wiring()
        for end, variable in ((wire.source, wire.source_variable), (wire.target, wire.target_variable))
        if (wire.target, wire.target_variable) not in OPTIONAL
    }
    needed = {row.name for row in table if (name, row.name) in used}
    matches = find_matches(table, needed, fmu.variables)
    fits = tuple(_fit(row, matches.get(row.name, ""), row.name in needed, fmu) for row in table)
    taken = set(matches.values())
    extra = tuple(
        key
        for key, each in fmu.variables.items()
        if each.causality == "input" and key not in taken and each.type == "Real"
    )
    faults = [
        f"{fit.variable} is missing, and the scenario connects it" if not fit.match else f"{fit.variable}: {fit.unit}"
        for fit in fits
        if not fit.fits
    ]
    found_faults, notes = _capabilities(fmu, scenario, name)
    missing = [fit.variable for fit in fits if not fit.match and not fit.needed]
    if missing:
        notes.insert(0, f"not there, and not connected: {', '.join(_families(missing))}")
    if any(fit.factor is not None for fit in fits):
        notes.append(
            "units with a ? are the same but for the rad, which one of the two leaves out: look whether the factor is "
            "right"
        )
    if extra:
        notes.append(f"inputs of the FMU that keep their start values: {', '.join(_families(extra))}")
    parameters = [key for key in STANDARD[name](scenario) if key not in fmu.variables]
    if parameters:
        notes.append(f"{len(parameters)} parameters of the scenario that it has not, so that its own values hold")
    return Swap(
        name=name,
        fmu=fmu,
        fits=fits,
        extra=extra,
        faults=tuple(_families(faults) + found_faults),
        notes=tuple(notes),
        changes=_changes(scenario, name, fmu, fits),
    )


def _fit(row: Row, match: str, needed: bool, fmu: FmuDescription) -> Fit:
    fit = Fit(variable=row.name, causality=row.causality, needed=needed, match=match, exact=match == row.name)
    if not match:
        return fit
    vendor, units = fmu.variables[match].unit, fmu.units
    source, target = (vendor, row.unit) if row.causality == "output" else (row.unit, vendor)
    ours, theirs = defined(row.unit or "", {}), defined(vendor or "", units)
    text, convertible, factor = "", True, None
    try:
        pair = (units, {}) if row.causality == "output" else ({}, units)
        gain, offset = unit_conversion(source, target, *pair)
        if not vendor or (gain, offset) == (1.0, 0.0):
            text = f"{row.unit}" if vendor else f"none, taken for {row.unit}"
        else:
            text = f"{source} → {target}, × {gain:.6g}" + (f" + {offset:g}" if offset else "")
    except ValueError:
        convertible = False
        text = f"{source} is not {target}"
        if ours is not None and theirs is not None and ours.exponents[:7] == theirs.exponents[:7]:
            factor = theirs.factor / ours.factor if row.causality == "output" else ours.factor / theirs.factor
            text = f"{source} → {target}, × {factor:.6g} ?"
    return Fit(
        variable=row.name,
        causality=row.causality,
        needed=needed,
        match=match,
        exact=fit.exact,
        unit=text,
        convertible=convertible,
        factor=factor,
    )


def _capabilities(fmu: FmuDescription, scenario: Scenario, name: str) -> tuple[list[str], list[str]]:
    """Faults and notes from what the FMU says that it can do."""
    faults, notes = [], []
    kind = CO_SIMULATION if CO_SIMULATION in fmu.kinds else next(iter(fmu.kinds))
    try:
        library_member(fmu, kind)
    except FmuError as error:
        faults.append(str(error).partition(": ")[2])
    can = fmu.kinds[kind].capabilities
    solved = kind != CO_SIMULATION
    variable = solved or can["canHandleVariableCommunicationStepSize"]
    notes.append(f"FMI {fmu.fmi_version}, {kind}" + (": the master solves its equations" if solved else ""))
    step, own = scenario.components[name].step, fmu.default_experiment.get("stepSize")
    suits = f"; it says {own:g} s by default" if own is not None else ""
    notes.append(
        f"step {step:g} s in the scenario{suits}; "
        + ("any step goes" if variable else "its step must not change: a step that it discards cannot be cut")
    )
    state, bytes_ = can["canGetAndSetFMUstate"], can["canSerializeFMUstate"]
    saved = "saved and restored, so its loop can be iterated" if state else "not saved, so no iteration of its loop"
    notes.append(f"state: {saved}; {'checkpoints' if state and bytes_ else 'no checkpoints'}")
    derived = sum(each.derivative_of is not None and each.causality == "output" for each in fmu.variables.values())
    if name == "platform":
        notes.append(
            f"{derived} outputs are declared derivatives of others"
            if derived
            else "no output is declared a derivative of another, so feedback is extrapolated by a line"
        )
    for flag, text in (
        ("canBeInstantiatedOnlyOncePerProcess", 'one instance a process: isolation = "process" for a second one'),
        ("needsExecutionTool", "it says that it needs another tool to run"),
    ):
        if can[flag]:
            notes.append(text)
    return faults, notes


def _changes(scenario: Scenario, name: str, fmu: FmuDescription, fits: Sequence[Fit]) -> dict[str, Any]:
    component: dict[str, Any] = {"fmu": str(fmu.path), "step": scenario.components[name].step}
    mapped = {fit.variable: fit.match for fit in fits if fit.match and not fit.exact}
    if mapped:
        component["map"] = mapped
    changes: dict[str, Any] = {"components": {name: component}}
    by_name = {fit.variable: fit for fit in fits}
    wires: dict[str, Any] = {}
    for wire in scenario.wiring():
        ends = ((wire.source, wire.source_variable), (wire.target, wire.target_variable))
        for end, variable in ends:
            fit = by_name.get(variable)
            if end == name and fit is not None and not fit.convertible and fit.factor is not None:
                target = f"{wire.target}.{wire.target_variable}"
                source = f"{wire.source}.{wire.source_variable}"
                wires[target] = {"from": source, "suppress_unit_conversion": True}
                if not math.isclose(fit.factor, 1.0):
                    wires[target]["factor"] = fit.factor * wire.factor
    if wires:
        changes["connections"] = wires
    return changes


def _families(names: Sequence[str]) -> list[str]:
    """Names with those of the six degrees of freedom, or of one number, as one with *."""
    pattern = "|".join(DEGREES_OF_FREEDOM)
    general = [re.sub(rf"(?<=\.)({pattern})\b|(?<=\[)\d+(?=\])", "*", name) for name in names]
    return list(
        dict.fromkeys(text if general.count(text) > 1 else name for text, name in zip(general, names, strict=True))
    )


def print_swap(found: Swap) -> None:
    """Table of what fits, faults, notes, and the lines for a scenario."""
    table = Table(title=f"{found.fmu.path.name} in the place of {found.name}")
    table.add_column("contract", no_wrap=True)
    for heading in ("(not connected)", "FMU", "unit", ""):
        table.add_column(heading, overflow="fold")
    for fit in (each for each in found.fits if each.needed or each.match):
        verdict = "ok" if fit.fits and fit.match else "missing" if not fit.match else "unit"
        table.add_row(
            escape(fit.variable),
            fit.causality if fit.needed else f"({fit.causality})",
            escape(fit.match) + ("" if fit.exact or not fit.match else " ?"),
            escape(fit.unit),
            verdict,
        )
    output.print(table)
    for kind, lines in (("error", found.faults), ("note", found.notes)):
        for line in lines:
            output.print(f"{kind}: {escape(line)}", soft_wrap=True)
    output.print(f"\n{escape(found.snippet)}", soft_wrap=True)
    if found.faults:
        output.print(f"It does not fit: {len(found.faults)} errors.")
    else:
        output.print("It fits; names with ? are proposals. `tlpsim check` of a scenario with these lines loads it.")


def write_scenario(found: Swap, scenario: str | Path, destination: str | Path) -> None:
    """Write a scenario file that is another one with the FMU in place; comments are lost, paths become absolute.

    Raises
    ------
    ScenarioError
        If the file exists already, or cannot be written.
    """
    file, target = Path(scenario), Path(destination)
    data = merge(with_absolute_paths(read_toml(file), file.resolve().parent), found.changes)
    head = f"# {file.name} with {found.fmu.path.name} in the place of {found.name}.\n\n"
    try:
        with target.open("x", encoding="utf-8") as stream:
            stream.write(head + to_toml(data))
    except FileExistsError:
        raise ScenarioError(f"{target}: the file exists already; give another name, or remove it") from None
    except OSError as error:
        raise ScenarioError(f"{target}: the scenario cannot be written: {error.strerror}") from error
