"""Units of variables: conversion between definitions, and definitions of units that are known by spelling only.

A unit is a product of powers of kg, m, s, A, K, mol, cd and rad with a factor and an offset (FMI 2.0.4, section
2.2.2), so that with x in the unit a and y in the unit b, both of the same exponents,

    y = (f_a x + o_a - o_b) / f_b                                                                     (1)

A component that gives a unit's name without a definition means by ``kN.m`` or ``m/s2`` what the International System
does: `spelled` reads products (``.``, ``*``, ``·`` or a space), quotients (``/``), powers (``m2``, ``m^2``, ``s-1``,
``m²``) and parentheses of the symbols below. A product after a quotient needs parentheses: ``a/b.c`` is read by some
as a/(b c), by others as (a/b) c.
"""

import math
import re
from collections.abc import Mapping
from functools import lru_cache

from tlpsim.orchestrator.instance import Unit

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

_ONE = Unit()


def _unit(factor: float = 1.0, offset: float = 0.0, **exponents: int) -> Unit:
    """Unit by the exponents of base units that are not zero."""
    kg, m, s, ampere, kelvin, mol, cd, rad = (exponents.get(name, 0) for name in BASE_UNITS)
    return Unit(exponents=(kg, m, s, ampere, kelvin, mol, cd, rad), factor=factor, offset=offset)


# with prefixes
_PREFIXED: Mapping[str, Unit] = {
    "g": _unit(1e-3, kg=1),
    "m": _unit(m=1),
    "s": _unit(s=1),
    "A": _unit(A=1),
    "K": _unit(K=1),
    "mol": _unit(mol=1),
    "cd": _unit(cd=1),
    "rad": _unit(rad=1),
    "N": _unit(kg=1, m=1, s=-2),
    "Pa": _unit(kg=1, m=-1, s=-2),
    "bar": _unit(1e5, kg=1, m=-1, s=-2),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    "Hz": _unit(s=-1),
    "C": _unit(A=1, s=1),
    "V": _unit(kg=1, m=2, s=-3, A=-1),
    "Ohm": _unit(kg=1, m=2, s=-3, A=-2),
    "T": _unit(kg=1, s=-2, A=-1),
    "L": _unit(1e-3, m=3),
    "l": _unit(1e-3, m=3),
}
_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6, "G": 1e9}
# without
_PLAIN: Mapping[str, Unit] = {
    "1": _ONE,
    "%": _unit(0.01),
    "t": _unit(1e3, kg=1),
    "min": _unit(60.0, s=1),
    "h": _unit(3600.0, s=1),
    "d": _unit(86400.0, s=1),
    "deg": _unit(math.pi / 180.0, rad=1),
    "°": _unit(math.pi / 180.0, rad=1),
    "rev": _unit(2.0 * math.pi, rad=1),
    "rpm": _unit(math.pi / 30.0, rad=1, s=-1),
    "kn": _unit(1852.0 / 3600.0, m=1, s=-1),
    "degC": _unit(offset=273.15, K=1),
    "°C": _unit(offset=273.15, K=1),
}
_SYMBOLS: Mapping[str, Unit] = {
    **{
        prefix + symbol: Unit(exponents=unit.exponents, factor=size * unit.factor)
        for prefix, size in _PREFIXES.items()
        for symbol, unit in _PREFIXED.items()
    },
    **_PREFIXED,
    **_PLAIN,
    "kg": _unit(kg=1),
}

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(
    r"\s*(?:(?P<symbol>1(?![0-9])|[A-Za-zµ°%]+)(?:(?:\^|\*\*)?(?P<power>[-+]?\d+)|(?:\^|\*\*)\((?P<enclosed>[-+]?\d+)\))?|(?P<mark>[()/.·*]))\s*"
)


def normalised(text: str | None) -> str:
    """Spelling of a unit without its variants; empty for none, and for the dimensionless ``1`` and ``-``."""
    plain = (text or "").translate(_SUPERSCRIPTS).replace("**", "^").replace(" ", "").replace("^", "")
    plain = plain.replace("*", ".").replace("·", ".")
    return "" if plain in ("1", "-") else plain


@lru_cache(maxsize=1024)
def spelled(text: str) -> Unit | None:
    """Definition of a unit by its spelling, None where that is not known."""
    tokens = _tokens(text.translate(_SUPERSCRIPTS).strip())
    if not tokens:
        return None
    unit, rest = _quotient(tokens)
    return None if rest else unit


def _tokens(text: str) -> list[Unit | str]:
    """Units with their powers, and the marks between them; empty for what is not known."""
    tokens: list[Unit | str] = []
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            return []
        position = match.end()
        if match["mark"]:
            tokens.append("." if match["mark"] in "·*" else match["mark"])
            continue
        unit = _SYMBOLS.get(match["symbol"])
        if unit is None:
            return []
        if tokens and (isinstance(tokens[-1], Unit) or tokens[-1] == ")"):
            tokens.append(".")  # a space between two symbols
        power = match["power"] or match["enclosed"]
        tokens.append(unit if power is None else _power(unit, int(power)))
    return tokens


def _quotient(tokens: list[Unit | str]) -> tuple[Unit | None, list[Unit | str]]:
    """Product, or quotients of products, at the head of the tokens, and the rest; None for what is no unit."""
    unit, tokens = _factor(tokens)
    divided = False
    while unit is not None and tokens and tokens[0] in ("/", "."):
        mark = tokens[0]
        if mark == "." and divided:
            return None, tokens
        divided = divided or mark == "/"
        other, tokens = _factor(tokens[1:])
        unit = None if other is None else _product(unit, other if mark == "." else _power(other, -1))
    return unit, tokens


def _factor(tokens: list[Unit | str]) -> tuple[Unit | None, list[Unit | str]]:
    if tokens and isinstance(tokens[0], Unit):
        alone = len(tokens) == 1
        # in a product a temperature is a difference, which has no offset
        return (tokens[0] if alone else _product(tokens[0], _ONE)), tokens[1:]
    if tokens and tokens[0] == "(":
        unit, rest = _quotient(tokens[1:])
        if unit is not None and rest and rest[0] == ")":
            return unit, rest[1:]
    return None, tokens


def _product(one: Unit, other: Unit) -> Unit:
    kg, m, s, ampere, kelvin, mol, cd, rad = (a + b for a, b in zip(one.exponents, other.exponents, strict=True))
    return Unit(exponents=(kg, m, s, ampere, kelvin, mol, cd, rad), factor=one.factor * other.factor)


def _power(unit: Unit, power: int) -> Unit:
    kg, m, s, ampere, kelvin, mol, cd, rad = (power * exponent for exponent in unit.exponents)
    return Unit(exponents=(kg, m, s, ampere, kelvin, mol, cd, rad), factor=unit.factor**power)


def defined(name: str, units: Mapping[str, Unit]) -> Unit | None:
    """Definition of a unit: the component's own, else that of the spelling; None where neither is known."""
    return units[name] if name in units else spelled(name)


def dimension(unit: Unit) -> str:
    """Base units of a unit, such as ``kg.m.s-2``; ``1`` for none."""
    powers = zip(BASE_UNITS, unit.exponents, strict=True)
    return ".".join(f"{name}{power if power != 1 else ''}" for name, power in powers if power) or "1"


def unit_conversion(
    source: str | None,
    target: str | None,
    source_units: Mapping[str, Unit],
    target_units: Mapping[str, Unit],
) -> tuple[float, float]:
    """Gain and offset from one unit to another, eq. (1).

    Parameters
    ----------
    source, target
        Names of the units. Where one is not declared, or is ``1`` and the other has a dimension, nothing is converted.
    source_units, target_units
        Definitions that go before those of the spelling.

    Returns
    -------
    Gain and offset: value in the target's unit = gain * value in the source's unit + offset. Exactly 1 and 0 for equal
    units.

    Raises
    ------
    ValueError
        If the exponents of the units differ, or one of two different units is not defined.
    """
    if not source or not target or source == "-" or target == "-":
        return 1.0, 0.0
    a, b = defined(source, source_units), defined(target, target_units)
    same = normalised(source) == normalised(target)
    if not (normalised(source) and normalised(target)) and not (a and b and a.exponents == b.exponents):
        return 1.0, 0.0
    if a is None or b is None:
        if same:
            return 1.0, 0.0
        unknown = source if a is None else target
        raise ValueError(f"{source} and {target} are different units, and what {unknown} is, is not defined")
    if a.exponents != b.exponents:
        if same:
            return 1.0, 0.0
        raise ValueError(f"{source} is of the dimension {dimension(a)} and {target} of {dimension(b)}")
    return a.factor / b.factor, (a.offset - b.offset) / b.factor
