"""JSON Schema (draft 2020-12) of a scenario file, with which editors complete and check keys as they are written.

It is made of the models in `tlpsim.scenarios.sections`, and of the comments in `typical_tlp.toml`, which say what each
key means; a field that the file does not write out has its `description` in the model. What the models' own validators
demand stands in `_RULES` and `_VALUES`, as far as JSON Schema can say it. It cannot compare one key with another, so
that a file which it accepts may still be refused: a peak outside the band, steps that do not divide each other, a
connection to a component that is not there. `tests/scenarios/test_json_schema.py` has the list.

A quantity's schema has, beside what JSON Schema knows, its base unit as `x-unit`.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

from tlpsim.loads.constants import DEGREES_OF_FREEDOM, MORISON
from tlpsim.scenarios.event_sections import MOST_TENDONS, Event
from tlpsim.scenarios.quantities import Dimension
from tlpsim.scenarios.schema import STANDARD_CONNECTIONS, Scenario
from tlpsim.scenarios.sections import (
    BUILTIN,
    BUILTIN_COMPONENTS,
    HULLS,
    Component,
    Connection,
    Platform,
    Segment,
    Waves,
    Wind,
)
from tlpsim.scenarios.toml_comments import KeyPath, key_comments

FILE = "scenario.schema.json"
EXPLAINED = Path(__file__).parent / "typical_tlp.toml"
DIALECT = "https://json-schema.org/draft/2020-12/schema"

Schema = dict[str, Any]

_NAME = r"[A-Za-z_][A-Za-z0-9_-]*"
_PLAIN = {bool: "boolean", int: "integer", float: "number", str: "string"}
_COMPLETED = (Component, Connection)  # by the standard ones
_LIMITS = {Gt: ("exclusiveMinimum", "gt"), Ge: ("minimum", "ge"), Lt: ("exclusiveMaximum", "lt"), Le: ("maximum", "le")}
_ONE, _SIX = "ConnectionOfOne", "ConnectionOfSix"
_DEGREES = "|".join((r"\*", *DEGREES_OF_FREEDOM))
_STANDARD = "|".join(re.escape(name).replace(r"\*", f"(?:{_DEGREES})") for name in STANDARD_CONNECTIONS)

_SOMETHING = [
    {"required": ["set"], "properties": {"set": {"minProperties": 1}}},
    {"required": ["lose_tendons"], "properties": {"lose_tendons": {"minItems": 1}}},
    {"required": ["current"]},
]
_QTF = {"properties": {"drift": {"const": "qtf"}}, "required": ["drift"]}
_RULES: dict[type[BaseModel], Schema] = {
    Event: {"anyOf": _SOMETHING},
    Wind: {"not": {"required": ["segments", "boxes"]}},
    Waves: {
        "if": _QTF,
        "then": {"required": ["quadratic_transfer"]},
        "else": {"not": {"required": ["quadratic_transfer"]}},
    },
}
_VALUES: dict[tuple[type[BaseModel], str], Schema] = {
    (Event, "values"): {"propertyNames": {"pattern": r"^[^.]+\..+$"}},
    (Event, "lose_tendons"): {"type": ["array", "integer"], "minimum": 1, "maximum": MOST_TENDONS},
    (Platform, "hydrodynamics"): {"anyOf": [{"enum": [*HULLS, MORISON]}, {"pattern": r"\.h5$"}]},
    (Wind, "segments"): {"minItems": 1},
    (Wind, "boxes"): {"minItems": 1},
    (Segment, "plan"): {"anyOf": [{"const": [0, 0]}, {"items": {"exclusiveMinimum": 0}}]},
    (Component, "fmu"): {
        "minLength": 0,
        "anyOf": [
            {"enum": [*(BUILTIN + name for name in BUILTIN_COMPONENTS), ""]},
            {"pattern": rf"^(?!{BUILTIN}).*\.([fF][mM][uU]|[cC][sS][vV])$"},
        ],
    },
}


def scenario_schema() -> Schema:
    """JSON Schema of a scenario file, every key of which may be left out."""
    comments = key_comments(EXPLAINED.read_text(encoding="utf-8"))
    definitions = {model.__name__: _model(model, path, comments) for model, path in _models(Scenario).items()}
    whole = definitions.pop(Scenario.__name__)
    whole["description"] = "A scenario of tlpsim: what differs from the default one. Every key may be left out."
    whole["properties"] |= {"components": _components(), "connections": _connections()}
    definitions |= {_ONE: _connection(r"[^*]+"), _SIX: _connection(r"[^*]*\*[^*]*")}
    return {"$schema": DIALECT, "title": "tlpsim scenario", **whole, "$defs": dict(sorted(definitions.items()))}


def _models(model: type[BaseModel], path: KeyPath = ()) -> dict[type[BaseModel], KeyPath]:
    """A model and those of the tables in it, each with the path of its first use."""
    found = {model: path}
    for name, field in model.model_fields.items():
        for each in _named(field.annotation):
            found = _models(each, (*path, name)) | found
    return found


def _named(annotation: Any) -> Iterator[type[BaseModel]]:
    """Models that a type is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for each in get_args(annotation):
        yield from _named(each)


def _model(model: type[BaseModel], path: KeyPath, comments: Mapping[KeyPath, str]) -> Schema:
    """Table of keys. Those without a default are required; of a component and a connection, see where they are used."""
    keys = {field.alias or name: (name, field) for name, field in model.model_fields.items()}
    required = [key for key, (_, field) in keys.items() if field.is_required()]
    schema: Schema = {
        "type": "object",
        "description": " ".join((model.__doc__ or "").replace("`", "").split()),
        "properties": {key: _field(model, *each, comments.get((*path, key), "")) for key, each in keys.items()},
        "additionalProperties": False,
    }
    if required and model not in _COMPLETED:
        schema["required"] = required
    return schema | _RULES.get(model, {})


def _field(model: type[BaseModel], name: str, field: FieldInfo, comment: str) -> Schema:
    schema = _value(field.annotation, field.metadata) | _VALUES.get((model, name), {})
    words = (field.alias or name).removesuffix("_deg").replace("_", " ").capitalize()
    unit = schema.get("x-unit", schema.get("items", {}).get("x-unit", ""))
    said = field.description or re.sub(rf"^{re.escape(unit)}(?![\w/.])[,;]?\s*", "", comment)
    words += f", {unit}" if unit not in ("", "1") else ""
    if "$ref" in schema and not said:
        return schema
    schema["description"] = f"{words}: {said}" if said else words
    default = field.get_default(call_default_factory=False)
    if not field.is_required() and default is not None and not isinstance(default, BaseModel):
        schema["default"] = list(default) if isinstance(default, tuple) else default
    return schema


def _value(annotation: Any, metadata: Sequence[Any]) -> Schema:
    """Schema of a type with its limits."""
    if get_origin(annotation) is Annotated:
        inner, *more = get_args(annotation)
        flat = [each for one in more for each in (one.metadata if isinstance(one, FieldInfo) else (one,))]
        return _value(inner, [*flat, *metadata])
    dimension = next((each for one in metadata if (each := _dimension(one)) is not None), None)
    schema: Schema = (
        _shape(annotation) if dimension is None else {"type": ["number", "string"], "x-unit": dimension.base_unit}
    )
    for one in metadata:
        if type(one) in _LIMITS:
            keyword, attribute = _LIMITS[type(one)]
            schema[keyword] = getattr(one, attribute)
        elif isinstance(one, MinLen):
            schema["minLength"] = one.min_length
    if dimension is not None:
        schema["pattern"] = _quantity_pattern(dimension, schema)
    return schema


def _shape(annotation: Any) -> Schema:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin in (Union, UnionType):
        kinds = [_value(each, ()) for each in arguments if each is not NoneType]
        if len(kinds) > 1 and all(set(kind) == {"type"} for kind in kinds):
            return {"type": [kind["type"] for kind in kinds]}
        return kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    if origin is tuple and arguments[-1] is Ellipsis:
        return {"type": "array", "items": _value(arguments[0], ())}
    if origin is tuple:
        size = {"minItems": len(arguments), "maxItems": len(arguments)}
        kinds = [_value(each, ()) for each in arguments]
        if all(kind == kinds[0] for kind in kinds):
            return {"type": "array", "items": kinds[0], **size}
        return {"type": "array", "prefixItems": kinds, **size}
    if origin is dict:
        return {"type": "object", "additionalProperties": _value(arguments[1], ())}
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {"$ref": f"#/$defs/{annotation.__name__}"}
    return {"type": _PLAIN[annotation]}


def _dimension(one: Any) -> Dimension | None:
    owner = getattr(one.func, "__self__", None) if isinstance(one, BeforeValidator) else None
    return owner if isinstance(owner, Dimension) else None


def _quantity_pattern(dimension: Dimension, limits: Mapping[str, Any]) -> str:
    """Regular expression of a number with or without a unit; of its limits only the sign can be asked for."""
    lowest = limits.get("minimum", limits.get("exclusiveMinimum", -1.0))
    sign = "[+]?" if lowest >= 0 else "[-+]?"
    positive = r"(?=\s*[+]?[0_.]*[1-9])" if limits.get("exclusiveMinimum") == 0 else ""
    number = r"(?:[0-9]+(?:_[0-9]+)*\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
    units = "|".join(re.escape(unit) for unit in dimension.units)
    return rf"^{positive}\s*{sign}{number}\s*(?:{units})?\s*$"


def _components() -> Schema:
    """Tables of components: of the three that are there any keys, of others an FMU and a step."""
    known = {"$ref": f"#/$defs/{Component.__name__}"}
    complete = {"anyOf": [{"required": ["fmu", "step"]}, {"properties": {"fmu": {"const": ""}}, "required": ["fmu"]}]}
    return {
        "type": "object",
        "description": 'Components by name: FMUs or tables with their steps; fmu = "" takes one out.',
        "properties": {name: known for name in BUILTIN_COMPONENTS},
        "patternProperties": {rf"^(?!(?:{'|'.join(BUILTIN_COMPONENTS)})$){_NAME}$": {"allOf": [known, complete]}},
        "additionalProperties": False,
    }


def _connection(variable: str) -> Schema:
    """Connection whose source has a name of a pattern, or is taken out."""
    source = {"pattern": rf"^({_NAME}\.{variable})?$"}
    return {"allOf": [{"$ref": f"#/$defs/{Connection.__name__}"}, {"properties": {"from": source}}]}


def _connections() -> Schema:
    """Tables of connections by target; `*` stands in the target and in the source, or in neither."""
    one, six = ({"$ref": f"#/$defs/{name}"} for name in (_ONE, _SIX))
    return {
        "type": "object",
        "description": 'Wiring, target = source; * stands for the six degrees of freedom; from = "" takes one out.',
        "properties": {name: six if "*" in name else one for name in STANDARD_CONNECTIONS},
        "patternProperties": {
            rf"^{_NAME}\.[^*]+$": one,
            rf"^{_NAME}\.[^*]*\*[^*]*$": six,
            rf"^(?!(?:{_STANDARD})$)": {"required": ["from"]},
        },
        "propertyNames": {"pattern": rf"^{_NAME}\.(?=.)[^*]*\*?[^*]*$"},
    }
