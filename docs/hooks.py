"""What MkDocs asks of this project while it builds the site: the parts of pages that are generated.

A line `<!-- generated: NAME -->` of a page is replaced by a part made of the program itself:

    commands             every command with its arguments, options and defaults, from `tlpsim.scenarios.cli.main`
    units                the units of quantities in a scenario, from `tlpsim.scenarios.quantities`
    scenario keys        every key of a scenario, from its JSON Schema, `tlpsim.scenarios.json_schema`
    benchmark SCRIPT     what `benchmarks/SCRIPT.py --json docs/data/SCRIPT.json` measured last
    comparison SCENARIO  Table I of the paper beside ours, from docs/data/SCENARIO.json, which is what
                         `tlpsim compare scenarios/SCENARIO.toml --json` printed

Formulas stand in italics with x_n for a subscript and e^{x} for a superscript, which the site sets as such. Other
comments (`<!-- long: ... -->`, `<!-- not run: ... -->`) are for `tests/test_documentation.py` and are taken out.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
DATA = DOCS / "data"
_GENERATED = re.compile(
    r"^<!-- generated: (?P<kind>commands|units|scenario keys|benchmark|comparison) ?(?P<what>\S*) -->$", re.M
)
_EMPHASIS = re.compile(r"<em>.*?</em>", re.DOTALL)
_FOR_TESTS = re.compile(r"^<!-- (?:long|not run): .* -->\n", re.M)


def on_config(config: Any) -> Any:
    """Leave pages that are not written out of the navigation, so that the site can be built without them."""
    config.nav = list(_present(config.nav))
    return config


def _present(entries: Sequence[Any]) -> Iterator[Any]:
    for entry in entries:
        ((title, target),) = entry.items()
        if isinstance(target, str):
            if (DOCS / target).exists():
                yield entry
        elif below := list(_present(target)):
            yield {title: below}


def on_page_markdown(markdown: str, **_: object) -> str:
    """Markdown of a page with its generated parts."""
    return _GENERATED.sub(lambda found: _generated(found["kind"], found["what"]), _FOR_TESTS.sub("", markdown))


def on_page_content(html: str, **_: object) -> str:
    """HTML of a page with subscripts within italics, and superscripts in braces, set as such; not in code."""
    pieces = re.split(r"(<pre.*?</pre>|<code.*?</code>)", html, flags=re.DOTALL)
    pieces[::2] = [
        _EMPHASIS.sub(_subscripts, re.sub(r"\^\{([^}<]*)\}", r"<sup>\1</sup>", each)) for each in pieces[::2]
    ]
    return "".join(pieces)


def _subscripts(found: re.Match[str]) -> str:
    return re.sub(r"_(?:\{([^}<]*)\}|([A-Za-z0-9]+))", lambda each: f"<sub>{each[1] or each[2]}</sub>", found[0])


def _generated(kind: str, what: str) -> str:
    makers = {"commands": commands, "units": units, "scenario keys": scenario_keys}
    return makers[kind]() if kind in makers else {"benchmark": benchmark, "comparison": comparison}[kind](what)


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; a bar within a cell is escaped."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


# Commands


def commands() -> str:
    """Every command: what it does, how it is called, its arguments and options."""
    import typer

    from tlpsim.scenarios.cli.main import app

    group: Any = typer.main.get_command(app)
    text = [f"{_code_in(group.help)}\n", table(("option of all commands", ""), _options(group.params))]
    for name, command in group.commands.items():
        arguments = [each for each in command.params if each.param_type_name == "argument"]
        options = [each for each in command.params if each.param_type_name == "option" and not each.hidden]
        needed = [f"{each.opts[0]} {each.metavar}" for each in options if each.required]
        call = " ".join(["tlpsim", name, *(_argument(each) for each in arguments), *needed])
        text += [
            f"\n### {name}\n",
            f"{_code_in(command.help)}\n",
            f"```text\n{call}{' [OPTIONS]' if options else ''}\n```\n",
        ]
        rows = [[f"`{each.metavar}`", _code_in(each.help or "")] for each in arguments] + _options(options)
        text.append(table(("argument, option", ""), rows))
    return "\n".join(text)


def _argument(argument: Any) -> str:
    return argument.metavar if argument.required else f"[{argument.metavar}]"


def _options(options: Sequence[Any]) -> list[list[str]]:
    rows = []
    for option in options:
        names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
        metavar = f" `{option.metavar}`" if option.metavar else ""
        notes = ["required"] if option.required else []
        if option.default not in (None, False, True, (), []):
            notes.append(f"default `{option.default}`")
        rows.append([names + metavar, _code_in(option.help or "") + (f" *({', '.join(notes)})*" if notes else "")])
    return rows


def _code_in(text: str) -> str:
    """Help as one paragraph; in it `< >` and `*` are not Markdown."""
    pieces = re.split(r"(`[^`]*`)", " ".join(text.split()))
    return "".join(each if each.startswith("`") else re.sub(r"([*<_])", r"\\\1", each) for each in pieces)


# Keys of a scenario


def units() -> str:
    """Units of each dimension, the base unit first."""
    from tlpsim.scenarios import quantities
    from tlpsim.scenarios.json_schema import scenario_schema

    used = set(re.findall(r'"x-unit": "([^"]*)"', json.dumps(scenario_schema(), ensure_ascii=False)))
    known = [each for each in vars(quantities).values() if isinstance(each, quantities.Dimension)]
    dimensions = [each for each in known if each.base_unit in used]
    rows = [[each.name, ", ".join(f"`{unit}`" for unit in each.units)] for each in dimensions]
    return table(("quantity", "units, the first without saying so"), rows)


def scenario_keys() -> str:
    """Every table of a scenario with its keys: default, what is allowed, and what it means."""
    from tlpsim.scenarios.json_schema import scenario_schema

    schema = scenario_schema()
    text = []
    for path, model in _tables(schema, schema, ""):
        text += [f"\n### {path or 'At the top'}\n", f"{_code_in(model['description'])}\n"]
        rows = [_key_row(key, each, model) for key, each in model["properties"].items()]
        text.append(table(("key", "default", "allowed", "meaning"), rows))
    return "\n".join(text)


def _tables(model: Mapping[str, Any], whole: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    """Tables of keys by their headers in TOML, a table before those in it; components and connections by any name."""
    yield path, {**model, "properties": _plain(model, whole)}
    named = {"components": ("Component", ".NAME"), "connections": ("Connection", '."TARGET"')} if not path else {}
    for key, schema in model["properties"].items():
        reference, name = named.get(key, (_reference(schema), ""))
        if reference:
            header = f"[{'.'.join(filter(None, (path.strip('[]'), key)))}{name}]"
            said = _said(schema) if "$ref" in schema else ""
            inner = dict(whole["$defs"][reference])
            inner["description"] += f" {said}" if said[:1].isupper() else ""  # a sentence, not a note behind a value
            yield from _tables(inner, whole, f"[{header}]" if "items" in schema else header)


def _plain(model: Mapping[str, Any], whole: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a table that are no tables themselves, but values or lists."""
    apart = ("components", "connections") if model is whole else ()
    properties = model["properties"].items()
    return {key: schema for key, schema in properties if "$ref" not in schema and key not in apart}


def _reference(schema: Mapping[str, Any]) -> str:
    """Name of the table that a key holds, or that each entry of a list is; "" of a value."""
    return str(schema.get("$ref", schema.get("items", {}).get("$ref", ""))).rpartition("/")[2]


def _key_row(key: str, schema: Mapping[str, Any], model: Mapping[str, Any]) -> list[str]:
    default = f"`{_toml(schema['default'])}`" if "default" in schema else ""
    if key in model.get("required", ()):
        default = "*required*"
    return [f"`{key}`", default, _allowed(schema), _code_in(_said(schema))]


def _said(schema: Mapping[str, Any]) -> str:
    """What is said of a key beside its name and unit."""
    return str(schema.get("description", "").partition(": ")[2])


def _toml(value: object) -> str:
    """A default as one writes it, large and small numbers with an exponent."""
    if isinstance(value, float):
        return re.sub(r"e([-+])0*(\d)", lambda found: f"e{found[1].strip('+')}{found[2]}", f"{value:g}")
    if isinstance(value, list):
        return f"[{', '.join(_toml(each) for each in value)}]"
    if isinstance(value, dict):
        return "{}"
    return json.dumps(value, ensure_ascii=False)


def _allowed(schema: Mapping[str, Any]) -> str:
    """Kind, unit and limits of a value in words."""
    if "enum" in schema:
        return ", ".join(f"`{_toml(each)}`" for each in schema["enum"])
    if schema.get("type") == "array":
        count = f"{schema['minItems']} × " if "maxItems" in schema else "list of "
        return count + ("tables, below" if "$ref" in schema["items"] else _allowed(schema["items"]))
    if schema.get("type") == "object":
        return "table"
    choices = ", ".join(f"`{_toml(each)}`" for part in schema.get("anyOf", ()) for each in part.get("enum", ()))
    if choices:
        return f"{choices} or a path"
    words = {"string": "text", "integer": "whole number", "number": "number", "boolean": "`true`, `false`"}
    kind = schema["type"] if isinstance(schema["type"], str) else schema["type"][-1].replace("string", "number")
    unit = schema.get("x-unit", "")
    parts = [words[kind] if unit in ("", "1") else unit]
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    parts += [f"{sign} {schema[word]}" for word, sign in signs.items() if word in schema]
    return ", ".join([*parts, "or a list"] if "array" in schema["type"] else parts)


# Figures of benchmarks


def benchmark(script: str) -> str:
    """What a benchmark measured last, or how to measure it."""
    path = DATA / f"{script}.json"
    if not path.exists():
        return f"No figures are kept here: `python benchmarks/{script}.py` measures and prints them."
    found = json.loads(path.read_text(encoding="utf-8"))
    rows = [
        [row["item"], row["measured"], row["bound"], {None: "", True: "yes", False: "**no**"}[row["ok"]]]
        for part in found["parts"]
        for row in part["rows"]
    ]
    seconds = sum(part["seconds"] for part in found["parts"])
    how = f"`python benchmarks/{script}.py{' --quick' if found['quick'] else ''}`, {seconds / 60.0:.0f} min"
    return f"{how}:\n\n{table(('item', 'measured', 'bound', 'kept'), rows)}"


def comparison(name: str) -> str:
    """Means and spreads of the six positions by both domains, and the paper's Table I beside them."""
    from tlpsim.scenarios.paper import TABLE_I
    from tlpsim.scenarios.statistics.summary import TABLE_UNITS

    path = DATA / f"{name}.json"
    if not path.exists():
        return f"No figures are kept here: `tlpsim compare scenarios/{name}.toml --json` makes them."
    found = json.loads(path.read_text(encoding="utf-8"))
    ours = {(row["name"], row["statistic"]): row for row in found["rows"]}
    rows = []
    for statistic, what in {"mean": "mean", "low_frequency": "below 0.022 Hz", "wave_frequency": "to 0.2 Hz"}.items():
        for degree, papers in TABLE_I.items():
            unit, factor = TABLE_UNITS[degree]
            row = ours[f"position.{degree}", statistic]
            time, error, frequency = (factor * row[each] for each in ("time", "error", "frequency"))
            cells = [f"{time:.2f} ± {error:.2f}", f"{frequency:.2f}", *(f"{each:.2f}" for each in papers[statistic])]
            rows.append([what if degree == "surge" else "", f"{degree}, {unit}", *cells])
    headings = ("", "", "time domain", "frequency domain", "paper, time", "paper, frequency")
    length = found["duration"] / 3600.0
    count = f"{found['records']} records of {length:g} h; ± is the standard error"
    return f"{table(headings, rows)}\n\nStandard deviations in two bands; {count}."
