"""`tlpsim swap`: whether an FMU can take a component's place, and the lines of a scenario that put it there.

The reference is the table of variables of the project's own component of that name (docs/fmu-contract.md), and the
scenario's wiring says which of them must be there. A vendor's variable of another name is found by what it is: its
degree of freedom, by a word of its name (``yaw``, ``Fx``, ``phi``) or its place among six of one name (``x[0]`` …
``x[5]``); its unit; and the words of its name and description. What is found so is a proposal, marked with ?.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from tlpsim.fmus.component import Variable as Row
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import FmuError, ScenarioError
from tlpsim.orchestrator.description import CO_SIMULATION, FmuDescription, library_member, read_description
from tlpsim.orchestrator.instance import Variable
from tlpsim.orchestrator.units import defined, unit_conversion
from tlpsim.scenarios.assemble import OPTIONAL, STANDARD
from tlpsim.scenarios.console import output
from tlpsim.scenarios.monolithic import COMPONENTS
from tlpsim.scenarios.problems import nearest
from tlpsim.scenarios.reading import merge, read_toml
from tlpsim.scenarios.schema import Scenario, with_absolute_paths

_OWN_DEGREES = {name: number for number, name in enumerate(DEGREES_OF_FREEDOM)}
_DEGREE_WORDS = {
    **_OWN_DEGREES,
    **{word: number for number, word in enumerate(("fx", "fy", "fz", "mx", "my", "mz"))},
    **{word: number + 3 for number, word in enumerate(("rx", "ry", "rz"))},
    **{word: number + 3 for number, word in enumerate(("phi", "theta", "psi"))},
    **{word: number for number, word in enumerate("xyz")},
}
_SYNONYMS = {
    **dict.fromkeys(("f", "load", "forces", "moment", "torque", "loads"), "force"),
    **dict.fromkeys(("pos", "disp", "displacement", "offset", "motion", "rotation", "angle"), "position"),
    **dict.fromkeys(("vel", "v", "speed", "rate"), "velocity"),
    **dict.fromkeys(("acc", "accel", "a"), "acceleration"),
    **dict.fromkeys(("eta", "zeta", "surface"), "elevation"),
    **dict.fromkeys(("mooring", "line", "tether", "tendons"), "tendon"),
    **dict.fromkeys(("waves", "hydro", "hydrodynamic"), "wave"),
    **dict.fromkeys(("aero", "aerodynamic"), "wind"),
    **dict.fromkeys(("ext", "additional", "other", "any"), "external"),
}
_IDLE = {"of", "the", "in", "at", "on", "and", "or", "a", "an", "to", "m", "s", "n", "rad", "deg", "kn", "for", "is", "it"}
_DEGREE, _UNIT, _WORDS = 0.4, 0.3, 0.3  # shares of a likeness
_ALIKE = 0.55  # least likeness of a proposal
_NEEDED = 0.2  # advantage of what the scenario connects over the rest


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
        raise ScenarioError(f"swap: there is no contract of a component '{name}'{nearest(name, known)}: {', '.join(known)}")
    fmu = read_description(path)
    table = [row for row in COMPONENTS[name].table if row.causality in ("input", "output")]
    used = {
        (end, variable)
        for wire in scenario.wiring()
        for end, variable in ((wire.source, wire.source_variable), (wire.target, wire.target_variable))
        if (wire.target, wire.target_variable) not in OPTIONAL
    }
    needed = {row.name for row in table if (name, row.name) in used}
    matches = _matches(table, needed, fmu.variables)
    fits = tuple(_fit(row, matches.get(row.name, ""), row.name in needed, fmu) for row in table)
    taken = set(matches.values())
    extra = tuple(
        key for key, each in fmu.variables.items() if each.causality == "input" and key not in taken and each.type == "Real"
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
            "units with a ? are the same but for the rad, which one of the two leaves out: look whether the factor is right"
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


def _words(name: str, description: str) -> set[str]:
    apart = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    found = [word for word in re.split(r"[^a-z]+", f"{apart} {description}".lower()) if word]
    return {_SYNONYMS.get(word, word) for word in found} - _IDLE


def _degrees(names: Sequence[str]) -> dict[str, int]:
    """Degree of freedom of each name, by a word in it or its place among six of one name; -1 for none."""
    families: dict[str, list[str]] = {}
    for name in names:
        families.setdefault(re.sub(r"\d+(?=\D*$)", "#", name), []).append(name)
    result = {}
    for members in families.values():
        for place, name in enumerate(members):
            words = re.findall(r"[a-z]+", re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name).lower())
            by_word = [_DEGREE_WORDS[word] for word in words[-1:] if word in _DEGREE_WORDS]
            if len(members) == len(DEGREES_OF_FREEDOM):
                by_word = [place]
            result[name] = by_word[0] if by_word else -1
    return result


def _matches(table: Sequence[Row], needed: Collection[str], variables: Mapping[str, Variable]) -> dict[str, str]:
    """The vendor's variable for each of the contract's, the same name first, then the most alike."""
    numbers = {key: each for key, each in variables.items() if each.type in ("Real", "Integer", "Boolean")}
    result = {
        row.name: row.name for row in table if row.name in numbers and numbers[row.name].causality == row.causality
    }
    rows = [row for row in table if row.name not in result]
    vendors = [each for key, each in numbers.items() if key not in result.values()]
    ours = {row.name: _OWN_DEGREES.get(row.name.rpartition(".")[2], -1) for row in table}
    theirs = _degrees([each.name for each in vendors])
    candidates = []
    for place, row in enumerate(rows):
        for each in vendors:
            if each.causality == row.causality:
                score = _likeness(row, each, ours[row.name], theirs[each.name])
                if score >= _ALIKE:
                    rank = round(score + _NEEDED * (row.name in needed), 6)
                    candidates.append((-rank, place, each.name, row.name))
    for _, _, vendor, own in sorted(candidates):
        if own not in result and vendor not in result.values():
            result[own] = vendor
    return result


def _likeness(row: Row, vendor: Variable, own_degree: int, degree: int) -> float:
    """How much a vendor's variable looks like one of the contract, from 0 to 1."""
    if own_degree != degree:
        return 0.0
    own, other = defined(row.unit or "", {}), defined(vendor.unit or "", {})
    if own is not None and other is not None and own.exponents[:7] != other.exponents[:7] and vendor.unit:
        return 0.0
    unit = 1.0 if own is not None and other is not None and vendor.unit else 0.5
    mine = _words(row.name, row.description)
    theirs = _words(vendor.name, vendor.description)
    common = len(mine & theirs) / max(min(len(mine), len(theirs)), 1)
    same_place = re.findall(r"\d+", row.name) == re.findall(r"\d+", vendor.name)
    place = 1.0 if own_degree >= 0 else (0.8 if same_place else 0.0)
    return _DEGREE * place + _UNIT * unit + _WORDS * common if common else 0.0


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
    notes.append(
        f"state: {'saved and restored, so its loop can be iterated' if state else 'not saved, so no iteration of its loop'}; "
        f"{'checkpoints' if state and bytes_ else 'no checkpoints'}"
    )
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
    return list(dict.fromkeys(text if general.count(text) > 1 else name for text, name in zip(general, names, strict=True)))


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


def to_toml(data: Mapping[str, Any]) -> str:
    """Nested mappings as TOML, connections one a line."""
    return "\n".join(_toml_lines(data, ())).strip() + "\n"


def _toml_lines(data: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    tables = {key: value for key, value in data.items() if isinstance(value, Mapping) and path[:1] != ("connections",)}
    plain = {key: value for key, value in data.items() if key not in tables}
    if path and (plain or not tables):
        yield f"\n[{'.'.join(_key(part) for part in path)}]"
    yield from (f"{_key(key)} = {_value(value)}" for key, value in plain.items())
    for key, value in tables.items():
        yield from _toml_lines(value, (*path, key))


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(each) for each in value) + "]"
    if isinstance(value, str | bool):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)
