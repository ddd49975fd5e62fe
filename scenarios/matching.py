"""Which variable of an FMU is which of the contract, where the names differ.

A variable is known by its degree of freedom, by a word of its name (``yaw``, ``Fx``, ``phi``) or its place among six of
one name (``x[0]`` … ``x[5]``); by its unit; and by the words of its name and description. The likeness of two is a
weighted sum of these, from 0 to 1, and 0 where the degree of freedom or the dimension of the unit is another one.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

from tlpsim.fmus.component import Variable as Row
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.instance import Variable
from tlpsim.orchestrator.units import defined

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
_IDLE = frozenset({"of", "the", "in", "at", "on", "and", "or", "a", "an", "to", "for", "is", "it"}) | {
    "m",
    "s",
    "n",
    "rad",
    "deg",
    "kn",
}
_DEGREE, _UNIT, _WORDS = 0.4, 0.3, 0.3  # shares of a likeness
_ALIKE = 0.55  # least likeness of a proposal
_NEEDED = 0.2  # advantage of what the scenario connects over the rest


def find_matches(table: Sequence[Row], needed: Collection[str], variables: Mapping[str, Variable]) -> dict[str, str]:
    """A vendor's variable for each of the contract's, the same name first, then the most alike.

    Parameters
    ----------
    table
        Inputs and outputs of the contract.
    needed
        Names of those that go before the others, where a variable of the vendor is like several.
    variables
        The vendor's, by name.

    Returns
    -------
    The vendor's name by that of the contract, without those that are like none.
    """
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
