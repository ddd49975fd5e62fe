"""The JSON Schema of scenario files, against the scenarios that exist and against what `Scenario` itself accepts."""

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from typer.testing import CliRunner

import tlpsim.scenarios.schema
from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.json_schema import FILE, scenario_schema
from tlpsim.scenarios.json_text import json_text
from tlpsim.scenarios.quantities import LENGTH, SPEED, TIME, Dimension
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.toml_comments import key_comments

FOLDER = Path(tlpsim.scenarios.schema.__file__).parent
SCENARIOS = [path for path in sorted(FOLDER.glob("*.toml")) if "hull" not in tomllib.loads(path.read_text())]
SCHEMA = scenario_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)
BOX = "{ position = [0, 0, 40], size = [90, 90, 12], shape_coefficient = 1.2 }"
SEGMENT = "position = [0, 0, 40], area = 500, shape_coefficient = 1.2"

VALID = {
    "nothing": "",
    "title": 'title = "Storm"',
    "numbers": "[wind]\nspeed = 30\nheading_deg = -200.5",
    "units": '[wind]\nspeed = "52 kn"\nroughness = "1 mm"\nheading_deg = "0.6 rad"',
    "number in text": '[site]\nwater_depth = "500"',
    "no space before the unit": '[simulation]\nduration = "3h"',
    "exponent and spaces": '[platform]\nmass = "  40.5e3 t "',
    "underscores": '[platform]\nmass = "40_500_000 kg"',
    "zero where it may be": '[waves]\nsignificant_height = 0\n[current]\nspeed = "0 m/s"',
    "percent": '[platform]\ndamping_ratios = [0, 0, "2 %", "2 %", "2 %", 0]',
    "database": '[platform]\nhydrodynamics = "hull.h5"',
    "morison": '[platform]\nhydrodynamics = "morison"',
    "tethers": '[platform.tendons]\naxial_stiffness = "3.3e5 MN"\ndiameter = "80 cm"',
    "segments": f"[wind]\nsegments = [{{ {SEGMENT} }}, {{ {SEGMENT}, plan = [90, 60] }}]",
    "segment of fixed area": f"[wind]\nsegments = [{{ {SEGMENT}, plan = [0, 0] }}]",
    "boxes": f"[wind]\nboxes = [{BOX}]",
    "inner tables": '[wind]\ncoherence = { model = "npd" }\norders = { long = 50, autoregressive = 5 }',
    "wave table": "[waves]\ntable = { frequency = [0.05, 0.07, 0.2], density = [0, 60.0, 0] }",
    "quadratic drift": '[waves]\ndrift = "qtf"\nquadratic_transfer = "qtf.h5"',
    "current table": '[current]\ntable = { depth = [0, "50 m"], speed = ["1 kn", 0.4], heading_deg = [96, 120] }',
    "iteration": '[coupling]\nalgorithm = "iterative"\niteration = { tolerance = 1e-6, acceleration = "aitken" }',
    "vendor": '[components.wave]\nfmu = "vendor.FMU"\nstep = 0.2\nmap = { "force.surge" = "Fx" }',
    "part of a component": "[components.wind]\nstep = 0.5",
    "parameters": '[components.wave.parameters]\na = 1\nb = true\nc = "[1, 2]"\nd = 0.5',
    "component taken out": '[components.wave]\nfmu = ""',
    "table of signals": '[components.wind]\nfmu = "wind.csv"\nparameters = { beyond = "hold" }',
    "further component": '[components.tug]\nfmu = "tug.fmu"\nstep = "0.5 s"\nisolation = "process"\ntimeout = "1 min"',
    "standard connection": '[connections]\n"platform.wind_force.*" = { filter = "quintic" }',
    "one of the six": '[connections]\n"platform.wind_force.yaw" = { extrapolation = "hold" }',
    "connection taken out": '[connections]\n"wave.velocity.heave" = { from = "" }\n"wind.velocity.*" = { from = "" }',
    "new connection": '[connections]\n"platform.external_force.*" = { from = "wind.force.*", factor = 0.5 }',
    "elements": '[connections]\n"platform.tendon_intact[3]" = { from = "wave.elevation" }',
    "events": '[[events]]\nat = "30 min"\nlose_tendons = 3\n[[events]]\nat = 0\nlose_tendons = [1, 2]',
    "event with values": '[[events]]\nat = 10\nset = { "platform.external_force.surge" = 1e6 }',
    "event of the current": '[[events]]\nat = 10\ncurrent = { speed = "2 kn", heading_deg = 90 }',
    "outputs": '[outputs]\nsignals = ["platform.position.*"]\nstatistics_from = "5 min"',
}

INVALID = {
    "unknown table": "[wnd]\nspeed = 3",
    "unknown key": "[wind]\nsped = 3",
    "unknown inner key": "[wind]\ncoherence = { lateal = 3 }",
    "number for a table": "wind = 3",
    "number for a title": "title = 3",
    "unit of another dimension": '[wind]\nspeed = "30 m"',
    "misspelt unit": '[wind]\nspeed = "30 knots"',
    "no number": '[wind]\nspeed = "fast"',
    "two points": '[wind]\nspeed = "3.0.1 m/s"',
    "double underscore": '[platform]\nmass = "40__500_000 kg"',
    "boolean for a number": "[wind]\nspeed = true",
    "below the limit": "[wind]\nspeed = -3",
    "below the limit with a unit": '[wind]\nspeed = "-3 m/s"',
    "at an open limit": "[site]\nwater_depth = 0",
    "at an open limit with a unit": '[site]\nwater_depth = "0.0 m"',
    "above the limit": "[wind]\nroughness = 20",
    "too few": "[platform]\ndamping_ratios = [0, 0]",
    "one of a list": "[platform]\ndamping_ratios = [0, 0, 0.02, 0.02, 0.02, -1]",
    "choice": '[wind]\nspectrum = "kaiml"',
    "text for a boolean": '[waves]\nsplash = "yes"',
    "broken number for a whole one": "[waves]\ndirections = 1.5",
    "too large a whole number": "[waves]\ndirections = 33",
    "negative seed": "[simulation]\nseed = -1",
    "seed of more than 31 bits": "[wind]\nseed = 2147483648",
    "database of another kind": '[platform]\nhydrodynamics = "hull.nc"',
    "segment without a position": "[wind]\nsegments = [{ area = 3, shape_coefficient = 1 }]",
    "no segments": "[wind]\nsegments = []",
    "a plan of one side": f"[wind]\nsegments = [{{ {SEGMENT}, plan = [90, 0] }}]",
    "segments and boxes": f"[wind]\nboxes = [{BOX}]\nsegments = [{{ {SEGMENT} }}]",
    "half a wave table": "[waves]\ntable = { frequency = [0.05, 0.07] }",
    "quadratic drift without its file": '[waves]\ndrift = "qtf"',
    "quadratic drift without its drift": '[waves]\nquadratic_transfer = "qtf.h5"',
    "empty file name": '[waves]\ndrift = "qtf"\nquadratic_transfer = ""',
    "component that is no FMU": '[components.wave]\nfmu = "wave"',
    "misspelt built-in FMU": '[components.wave]\nfmu = "builtin:wav.fmu"',
    "further component without an FMU": "[components.tug]\nstep = 1",
    "further component without a step": '[components.tug]\nfmu = "tug.fmu"',
    "name of a component": '[components."a.b"]\nfmu = "x.fmu"\nstep = 1',
    "list for a parameter": "[components.wave]\nparameters = { a = [1] }",
    "number for a name": '[components.wave]\nmap = { "force.surge" = 1 }',
    "isolation": '[components.wave]\nisolation = "thread"',
    "connection without a source": '[connections]\n"platform.external_force.surge" = { filter = "hold" }',
    "misspelt from": '[connections]\n"platform.external_force.surge" = { fom = "wind.force.surge" }',
    "six from one": '[connections]\n"platform.wind_force.*" = { from = "wind.force.surge" }',
    "one from six": '[connections]\n"platform.wind_force.surge" = { from = "wind.force.*" }',
    "target without a variable": '[connections]\n"platform" = { from = "wind.wind_speed" }',
    "source without a variable": '[connections]\n"platform.elevation" = { from = "wind" }',
    "filter": '[connections]\n"platform.wind_force.*" = { filter = "spline" }',
    "event without a time": "[[events]]\nlose_tendons = 3",
    "event that does nothing": "[[events]]\nat = 10\nset = {}",
    "tendon that is not there": "[[events]]\nat = 10\nlose_tendons = [3, 13]",
    "one tendon that is not there": "[[events]]\nat = 10\nlose_tendons = 0",
    "value of no component": "[[events]]\nat = 10\nset = { force = 1e6 }",
    "unknown key of a current": "[[events]]\nat = 10\ncurrent = { doppler = true }",
    "one table of events": "[events]\nat = 10",
    "signals": "[outputs]\nsignals = 3",
}

# What JSON Schema cannot know: it compares no key with another, takes text for text and 1.0 for a whole number.
BEYOND = {
    "limit other than zero, in text": '[wind]\nroughness = "20 m"',
    "a number too large for a float, in text": '[wind]\nspeed = "1e999 m/s"',
    "not a number": "[wind]\nspeed = nan",
    "whole number written as a broken one": "[waves]\ndirections = 2.0",
    "peak outside the band": "[waves]\npeak_period = 2",
    "sampling step for the band": "[waves]\nsampling_step = 1.5",
    "order above the long one": "[wind]\norders = { long = 4, autoregressive = 5 }",
    "frequencies that do not rise": "[waves]\ntable = { frequency = [0.1, 0.1], density = [1, 2] }",
    "columns of unequal length": "[current]\ntable = { depth = [0, 50], speed = [1], heading_deg = [1, 2] }",
    "box below the water": "[wind]\nboxes = [{ position = [0, 0, 4], size = [9, 9, 9], shape_coefficient = 1 }]",
    "water shallower than the draught": "[site]\nwater_depth = 30",
    "imbalance": "[platform.tendons]\npretension = 1e6",
    "steps that do not divide": "[components.wind]\nstep = 0.75",
    "component that is not there": '[connections]\n"platform.wind_force.*" = { from = "wnd.force.*" }',
    "connection of a component taken out": '[components.wave]\nfmu = ""\n'
    '[connections]\n"platform.wave_force.*" = { filter = "hold" }',
}


def accepted(text: str) -> bool:
    try:
        Scenario.from_dict(tomllib.loads(text))
    except ScenarioError:
        return False
    return True


@pytest.mark.parametrize("name", VALID)
def test_both_accept(name: str) -> None:
    VALIDATOR.validate(tomllib.loads(VALID[name]))
    assert accepted(VALID[name])


@pytest.mark.parametrize("name", INVALID)
def test_both_refuse(name: str) -> None:
    assert not VALIDATOR.is_valid(tomllib.loads(INVALID[name]))
    assert not accepted(INVALID[name])


@pytest.mark.parametrize("name", BEYOND)
def test_only_the_program_refuses(name: str) -> None:
    assert VALIDATOR.is_valid(tomllib.loads(BEYOND[name]))
    assert not accepted(BEYOND[name])


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.name)
def test_scenarios_name_the_schema_and_keep_it(path: Path) -> None:
    assert path.read_text().startswith(f"#:schema {FILE}\n")
    VALIDATOR.validate(tomllib.loads(path.read_text()))


def test_a_whole_scenario_keeps_it() -> None:
    """Every default is one that the schema allows."""
    VALIDATOR.validate(Scenario().model_dump(mode="json", by_alias=True, exclude_none=True))


TEXTS = st.text("0123456789.+-_eE mkh/snc", max_size=12)


@pytest.mark.parametrize(("dimension", "key"), [(TIME, "peak_period"), (LENGTH, "water_depth"), (SPEED, "speed")])
@given(
    text=st.one_of(TEXTS, st.from_regex(r"\A ?[-+]?[0-9._]{1,5}([eE][-+]?[0-9]{1,2})? ?(m|km|cm|s|h|kn|m/s|km/h)?\Z"))
)
def test_patterns_of_quantities_are_what_the_program_reads(dimension: Dimension, key: str, text: str) -> None:
    table = {"peak_period": "Waves", "water_depth": "Site", "speed": "Wind"}[key]
    schema = SCHEMA["$defs"][table]["properties"][key]
    assert jsonschema.Draft202012Validator(schema).is_valid(text) == _parses(dimension, schema, text)


def _parses(dimension: Dimension, schema: dict[str, Any], text: str) -> bool:
    """Whether the program takes the text, with a limit of zero; the tiniest numbers are zero to it."""
    try:
        value = dimension.parse(text)
    except ValueError as error:
        assume("finite" not in str(error))  # a pattern cannot tell numbers that are too large for a float
        return False
    positive = value > 0.0 or (value == 0.0 and any(digit in text.lower().partition("e")[0] for digit in "123456789"))
    return positive or ("minimum" in schema and value == 0.0 and "-" not in text.lower().partition("e")[0])


def test_it_is_a_schema_all_of_whose_references_lead_somewhere() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    text = json.dumps(SCHEMA)
    referred = {part.partition('"')[0] for part in text.split('"#/$defs/')[1:]}
    assert referred == set(SCHEMA["$defs"])


# Keys whose name and unit say all.
PLAIN = {
    ("title",), ("simulation",), ("site",), ("platform",), ("wind",), ("waves",), ("current",), ("outputs",),
    ("water_depth",), ("water_density",), ("air_density",), ("gravity",), ("mass",), ("yaw_inertia",), ("peak_period",),
}  # fmt: skip


def test_every_key_is_explained_in_one_place() -> None:
    """In `typical_tlp.toml` or at the field; a key in neither is one whose name says all."""
    for name, definition in {"": SCHEMA, **SCHEMA["$defs"]}.items():
        for key, schema in definition.get("properties", {}).items():
            explained = ": " in schema.get("description", "") or "$ref" in schema or (key,) in PLAIN
            assert explained or name == "", f"{name}.{key}: explain it behind its line in typical_tlp.toml"


def test_comments_of_a_toml_file() -> None:
    text = """# About the file.

# About the table,
# in two lines.
[table]
# Before it.
first = 1   # behind it,
            # and below it
second = "a # b"   # quoted
# third = { a = 1 }   # left out
fourth = 4

# About nothing.

[table.inner]
fifth = 5
"""
    assert key_comments(text) == {
        ("table",): "About the table, in two lines.",
        ("table", "first"): "Before it. behind it, and below it",
        ("table", "second"): "quoted",
        ("table", "third"): "left out",
    }


def test_the_file_beside_the_scenarios_is_current() -> None:
    written = (FOLDER / FILE).read_text(encoding="utf-8")
    assert written == json_text(scenario_schema()) + "\n", f"run: tlpsim schema -o scenarios/{FILE}"


def test_the_command_prints_and_writes_it(tmp_path: Path) -> None:
    printed = CliRunner().invoke(app, ["schema"])
    written = CliRunner().invoke(app, ["schema", "-o", str(tmp_path / "s.json")])
    assert json.loads(printed.output) == json.loads((tmp_path / "s.json").read_text()) == SCHEMA
    assert written.output.startswith("schema: ")


def test_a_schema_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="cannot be written"):
        CliRunner().invoke(app, ["schema", "-o", str(tmp_path)], catch_exceptions=False)
