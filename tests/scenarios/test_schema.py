"""Scenarios: the default one, what files and settings change in it, and what is refused with which words."""

import tomllib
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

import tlpsim.scenarios.schema
from tlpsim.fmus.platform_fmu import MEMORY
from tlpsim.fmus.wave_parameters import DRIFTS
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.loads.waves import spectra as wave_spectra
from tlpsim.loads.wind import spectra as wind_spectra
from tlpsim.loads.wind.admittance import ADMITTANCES
from tlpsim.loads.wind.coherence import COHERENCES
from tlpsim.loads.wind.force import DECOMPOSITIONS
from tlpsim.loads.wind.profile import PROFILES
from tlpsim.orchestrator.system import ACCELERATIONS, ALGORITHMS, ANTI_ALIAS, EXTRAPOLATIONS
from tlpsim.scenarios.reading import merge, parse_override
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import HULLS, LARGEST_SEED, Coupling, LoopIteration, Platform, Waves, Wind, WindCoherence

TYPICAL = Path(tlpsim.scenarios.schema.__file__).with_name("typical_tlp.toml")

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write_scenario(text: str) -> Path:
        path = tmp_path / "storm.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write_scenario


def refusal(path: Path, *overrides: str) -> str:
    with pytest.raises(ScenarioError) as caught:
        Scenario.load(path, overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


# What a scenario is


def test_an_empty_file_is_the_default_scenario(write: Write) -> None:
    assert Scenario.load(write("")) == Scenario() == Scenario.from_dict({})


def test_the_typical_scenario_writes_every_default_out() -> None:
    assert Scenario.load(TYPICAL) == Scenario()
    written = tomllib.loads(TYPICAL.read_text(encoding="utf-8"))
    sections = Scenario().model_dump(by_alias=True, exclude_none=True)
    assert set(written) == set(sections) - {"events"}
    for name in set(written) - {"title", "components", "connections"}:
        assert set(written[name]) == set(sections[name])
    assert set(written["platform"]["tendons"]) == set(sections["platform"]["tendons"])


def test_the_standard_wiring_joins_each_degree_of_freedom() -> None:
    wires = Scenario().wiring()
    assert len(wires) == 5 * 6 + 2
    forces = [wire for wire in wires if wire.target_variable.startswith("wind_force.")]
    assert [wire.source_variable for wire in forces] == [f"force.{name}" for name in DEGREES_OF_FREEDOM]
    assert {(wire.source, wire.target) for wire in forces} == {("wind", "platform")}
    assert {(wire.filter, wire.extrapolation) for wire in wires} == {("cubic", "derivatives")}


def test_json_gives_an_equal_scenario(write: Write) -> None:
    path = write(
        """
        title = "Sturm – “breit”"
        [wind]
        seed = 3
        segments = [{ position = [0, "-12 m", 30], area = 3000, shape_coefficient = 1.2 }]
        [components.wave]
        fmu = ""
        [components.other]
        fmu = "other.fmu"
        step = 0.2
        parameters = { name = "a", number = 3, ratio = 0.5, on = true }
        [connections]
        "platform.external_force.surge" = { from = "other.Fx", filter = "hold" }
        """
    )
    scenario = Scenario.load(path)
    again = Scenario.from_json(scenario.to_json())
    assert again == scenario
    parameters = again.components["other"].parameters
    assert [type(value) for value in parameters.values()] == [str, int, float, bool]


def test_the_choices_are_those_of_the_physics() -> None:
    def choices(section: type[BaseModel], key: str) -> set[str]:
        return set(get_args(section.model_fields[key].annotation))

    assert choices(Wind, "spectrum") == set(wind_spectra.SPECTRA)
    assert choices(Wind, "profile") == set(PROFILES)
    assert choices(WindCoherence, "model") == set(COHERENCES)
    assert choices(Wind, "admittance") == set(ADMITTANCES)
    assert choices(Wind, "decomposition") == set(DECOMPOSITIONS)
    assert choices(Waves, "spectrum") == set(wave_spectra.SPECTRA)
    assert choices(Waves, "drift") == set(DRIFTS)
    assert choices(Coupling, "filter") == {*SYMMETRIC, ANTI_ALIAS}
    assert choices(Coupling, "algorithm") == set(ALGORITHMS)
    assert choices(LoopIteration, "acceleration") == set(ACCELERATIONS)
    assert choices(Coupling, "extrapolation") == set(EXTRAPOLATIONS)
    assert choices(Platform, "model") == set(HULLS)
    assert choices(Platform, "radiation") == set(MEMORY)


# Files, settings and changes


def test_what_is_written_goes_over_the_defaults(write: Write) -> None:
    scenario = Scenario.load(
        write('[wind]\nspeed = "52 kn"\n[components.wind]\nstep = 0.5\n[simulation]\nduration = "3 h"'),
        ["simulation.duration=30 min", "wind.spectrum=harris", "waves.components=100", 'title="A = B"'],
    )
    assert scenario.wind.speed == pytest.approx(52 * 1852 / 3600)
    assert scenario.wind.heading_deg == Scenario().wind.heading_deg
    assert scenario.components["wind"].fmu == "builtin:wind"
    assert scenario.components["wind"].step == 0.5
    assert scenario.simulation.duration == 1800.0
    assert scenario.wind.spectrum == "harris"
    assert scenario.waves.components == 100
    assert scenario.title == "A = B"


def test_a_file_from_windows_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "storm.toml"
    path.write_bytes(b"\xef\xbb\xbf[wind]\r\nspeed = 20\r\n")
    assert Scenario.load(path).wind.speed == 20.0


def test_paths_of_fmus_are_relative_to_the_scenario(write: Write, tmp_path: Path) -> None:
    path = write('[components.wind]\nfmu = "vendor/wind.fmu"\nmap = { "force.surge" = "Fx" }')
    wind = Scenario.load(path).components["wind"]
    assert wind.fmu == str(tmp_path.resolve() / "vendor" / "wind.fmu")
    assert wind.own_name("force.surge") == "Fx"
    assert wind.own_name("force.sway") == "force.sway"


def test_the_path_of_a_database_is_relative_to_the_scenario(write: Write, tmp_path: Path) -> None:
    path = write('[platform]\nhydrodynamics = "hull/coefficients.h5"')
    assert Scenario.load(path).platform.hydrodynamics == str(tmp_path / "hull" / "coefficients.h5")
    assert Scenario.load(path, ["platform.hydrodynamics=other.h5"]).platform.hydrodynamics == str(tmp_path / "other.h5")
    assert Scenario.load(path, ["platform.hydrodynamics=morison"]).platform.hydrodynamics == "morison"


def test_the_path_of_a_quadratic_transfer_function_is_relative_to_the_scenario(write: Write, tmp_path: Path) -> None:
    path = write('[waves]\ndrift = "qtf"\nquadratic_transfer = "hull/qtf.h5"')
    assert Scenario.load(path).waves.quadratic_transfer == str(tmp_path / "hull" / "qtf.h5")
    assert Scenario.load(path, ["waves.quadratic_transfer=h.12d"]).waves.quadratic_transfer == str(tmp_path / "h.12d")


def test_connections_add_to_override_and_remove_the_standard_ones(write: Write) -> None:
    scenario = Scenario.load(
        write(
            """
            [coupling]
            filter = "linear"
            [components.tug]
            fmu = "tug.fmu"
            step = 0.1
            [connections]
            "platform.wind_force.*" = { filter = "quintic" }
            "platform.wind_force.yaw" = { from = "tug.moment", filter = "hold" }
            "platform.external_force.*" = { from = "tug.force.*", extrapolation = "hold" }
            "wave.velocity.heave" = { from = "" }
            """
        )
    )
    wires = {f"{wire.target}.{wire.target_variable}": wire for wire in scenario.wiring()}
    assert len(wires) == 32 + 6 - 1
    assert wires["platform.wind_force.sway"].source_variable == "force.sway"
    assert wires["platform.wind_force.sway"].filter == "quintic"
    assert (wires["platform.wind_force.yaw"].source, wires["platform.wind_force.yaw"].filter) == ("tug", "hold")
    assert wires["platform.external_force.yaw"].source_variable == "force.yaw"
    assert wires["platform.external_force.yaw"].extrapolation == "hold"
    assert "wave.velocity.heave" not in wires
    assert wires["wave.velocity.sway"].filter == "linear"


def test_a_removed_component_takes_its_standard_connections_along(write: Write) -> None:
    scenario = Scenario.load(write('[components.wave]\nfmu = ""'))
    assert list(scenario.components) == ["wind", "platform"]
    assert not any("wave" in (wire.source, wire.target) for wire in scenario.wiring())
    assert scenario.with_(title="Calm sea").components == scenario.components


def test_with_changes_a_copy() -> None:
    scenario = Scenario()
    other = scenario.with_(**{"wind.speed": "30 kn", "components.wind.step": 2.0}, simulation={"seed": 5})
    assert (other.wind.speed, other.components["wind"].step, other.simulation.seed) == (
        pytest.approx(15.4333, rel=1e-5),
        2.0,
        5,
    )
    assert other.waves == scenario.waves
    assert scenario == Scenario()
    with pytest.raises(ScenarioError, match=r"with_\(\): wind.speed = -1: must be at least 0"):
        scenario.with_(**{"wind.speed": -1})


def test_a_setting_is_a_line_of_toml_or_text() -> None:
    assert parse_override("a.b=1") == {"a": {"b": 1}}
    assert parse_override("a.b=[1, 2]") == {"a": {"b": [1, 2]}}
    assert parse_override("a = 3 h") == {"a": "3 h"}
    assert parse_override('connections."p.f.*".from=') == {"connections": {"p.f.*": {"from": ""}}}
    for text in ("a.b", "=3", "a..b=3"):
        with pytest.raises(ScenarioError, match="KEY=VALUE"):
            parse_override(text)


TREES = st.recursive(
    st.integers(), lambda below: st.dictionaries(st.sampled_from("abc"), below, max_size=3), max_leaves=8
).filter(lambda tree: isinstance(tree, dict))


@given(TREES, TREES, TREES)
def test_merging_is_associative_where_shapes_agree_and_has_a_neutral_element(a: dict, b: dict, c: dict) -> None:
    assert merge(a, {}) == a == merge({}, a)
    assert merge(a, a) == a
    assert merge(merge(a, {"d": b}), {"d": c}) == merge(a, {"d": merge(b, c)})


# Seeds


@given(st.integers(0, 10**6))
def test_seeds_are_31_bit_differ_and_depend_on_the_scenarios_seed_alone(seed: int) -> None:
    scenario = Scenario.from_dict({"simulation": {"seed": seed}})
    seeds = scenario.seeds()
    assert set(seeds) == {"wind", "wave"}
    assert all(0 < value <= LARGEST_SEED for value in seeds.values())
    assert seeds["wind"] != seeds["wave"]
    assert seeds == scenario.with_(**{"wind.speed": 5}).seeds()
    assert set(seeds.values()).isdisjoint(scenario.with_(simulation={"seed": seed + 1}).seeds().values())


def test_a_given_seed_is_kept_and_not_given_twice() -> None:
    derived = Scenario().seeds()
    assert Scenario.from_dict({"wind": {"seed": 7}}).seeds() == {"wind": 7, "wave": derived["wave"]}
    seeds = Scenario.from_dict({"wind": {"seed": derived["wave"]}}).seeds()
    assert seeds["wave"] != seeds["wind"]


# Refusals: each message has the file, the key, the value, what is allowed, and a way out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[wind]\nspeed = -3", ["wind.speed = -3", "at least 0", "default is 26.9"]),
        ("[current]\nspeed = -1", ["current.speed = -1", "at least 0"]),
        ("[wind]\nsped = 3", ["wind.sped", "unknown key", "did you mean 'speed'", "heading_deg"]),
        ("[wnd]\nspeed = 3", ["wnd", "unknown key", "did you mean 'wind'"]),
        ('[wind]\nspectrum = "kaiml"', ["wind.spectrum", "kaiml", "'kaimal', 'kareem', 'davenport', 'harris'"]),
        ('[wind]\nspeed = "30 m"', ["wind.speed", "'m' is not a unit of speed", "'km/h'"]),
        ("[wind]\nspeed = nan", ["wind.speed", "finite"]),
        ("[wind]\nroughness = 20", ["wind.roughness = 20", "less than 10"]),
        ("[wind]\nsegments = [{ area = 3 }]", ["wind.segments[0].position", "missing", "and 1 more"]),
        ("[wind]\nsegments = []", ["wind.segments", "1 or more"]),
        ("[wind]\nboxes = []", ["wind.boxes", "1 or more"]),
        (
            "[wind]\nsegments = [{ position = [0, 0, 9], area = 9, shape_coefficient = 1, plan = [90, 0] }]",
            ["wind.segments[0].plan", "must be a length and a width > 0, or [0, 0]"],
        ),
        (
            "[wind]\nboxes = [{ position = [0, 0, 4], size = [9, 9, 9], shape_coefficient = 1 }]",
            ["wind.boxes[0].position[2] = 4", "below the water"],
        ),
        (
            "[wind]\nboxes = [{ position = [0, 0, 9], size = [9, 9, 9], shape_coefficient = 1 }]\n"
            "segments = [{ position = [0, 0, 9], area = 9, shape_coefficient = 1 }]",
            ["wind.boxes", "give one of them"],
        ),
        ("[wind.coherence]\nmodel = 'nbd'", ["wind.coherence.model", "'davenport' or 'npd'"]),
        ("[wind.coherence]\nvertical = -1", ["wind.coherence.vertical = -1", "at least 0", "default is 10"]),
        (
            "[wind]\norders = { long = 4, autoregressive = 5 }",
            ["wind.orders.autoregressive = 5", "at most the order of the long one, 4"],
        ),
        ("[wind.orders]\nlong = 2.5", ["wind.orders.long", "whole number"]),
        ("[wind]\nprofile = 'log'", ["wind.profile", "'logarithmic'", "'iso'"]),
        ("[waves]\nsignificant_height = -1", ["waves.significant_height = -1", "at least 0"]),
        ("[waves]\ndirections = 0", ["waves.directions = 0", "at least 1"]),
        ("[waves]\nsampling_step = 1.5", ["waves.sampling_step = 1.5", "less than 1.299 s", "0.35 Hz"]),
        ("[waves]\norders = { long = 7 }", ["waves.orders.autoregressive", "at most the order of the long one, 7"]),
        ("[waves]\ntable = { frequency = [0.1, 0.1], density = [1, 2] }", ["waves.table", "must rise"]),
        (
            "[waves]\ntable = { frequency = [0.1, 0.5], density = [1, 2] }",
            ["waves.frequency_max = 0.35", "peak of the spectrum at 0.5 Hz, of the table"],
        ),
        ("[waves]\npeak_period = 2", ["waves.frequency_max = 0.35", "peak of the spectrum at 0.5 Hz"]),
        ("[waves]\nfrequency_max = 0.01", ["waves.frequency_max = 0.01", "greater than frequency_min, 0.02"]),
        ("[waves]\ncomponents = 1.5", ["waves.components = 1.5", "whole number"]),
        ('[waves]\ndisplaced_position = "yes"', ["waves.displaced_position", "true or false"]),
        ("[site]\nwater_depth = 30", ["site.water_depth = 30", "draught of issc_tlp, 35 m"]),
        ('[waves]\ndrift = "qtf"', ["waves.drift", "quadratic_transfer", "tlpsim bem", "--qtf FILE.h5"]),
        (
            '[waves]\nquadratic_transfer = "qtf.h5"',
            ["waves.quadratic_transfer", 'is for waves.drift = "qtf", and that is "newman"', "leave the file out"],
        ),
        ('[waves]\ndrift = "qtf"\nquadratic_transfer = ""', ["waves.quadratic_transfer", "must not be empty"]),
        (
            '[platform]\nhydrodynamics = "morrison"',
            ["platform.hydrodynamics", "(.h5)", "did you mean 'morison'", 'default is "issc_tlp"'],
        ),
        ('[platform]\nradiation = "memory"', ["platform.radiation", "'convolution', 'state_space' or 'none'"]),
        ("[platform]\ndamping_ratios = [0, 0]", ["platform.damping_ratios[2]", "missing"]),
        ('[simulation]\nstart = "rst"', ["simulation.start", "'equilibrium' or 'rest'"]),
        ("[simulation]\nseed = -1\nduration = 0\n", ["simulation.duration = 0", "and 1 more"]),
        ("wind = 3", ["wind = 3", "table"]),
        ("components = 3", ["components = 3", "table"]),
        ("connections = 3", ["connections = 3", "table"]),
        ("[components.wnd]\nstep = 1", ["components.wnd.fmu", "missing"]),
        ('[components.wave]\nfmu = "builtin:wav"', ["components.wave.fmu", "did you mean 'builtin:wave'"]),
        ('[components.wave]\nfmu = "wave"', ["components.wave.fmu", ".fmu file", "did you mean 'builtin:wave'"]),
        ("[components.wave]\nparameters = { a = [1] }", ["components.wave.parameters.a", "JSON"]),
        ("[components.wave]\nparameters = { a = inf }", ["components.wave.parameters.a", "finite"]),
        ('[components.wave]\nisolation = "thread"', ["components.wave.isolation", "'none' or 'process'"]),
        ("[components.wave]\ntimeout = 0", ["components.wave.timeout = 0"]),
        ('[components."a.b"]\nfmu = "x.fmu"\nstep = 1', ['components."a.b"', "letters"]),
        (
            '[connections]\n"platform.wind_force.*" = { from = "wnd.force.*" }',
            ['connections."platform.wind_force.*".from = "wnd.force.*"', "did you mean 'wind'"],
        ),
        (
            '[connections]\n"platform.wind_force.*" = { from = "wind.force.surge" }',
            ['"platform.wind_force.*"', "once in the target and once in 'from'"],
        ),
        (
            '[connections]\n"platform.wind_force.*" = { filter = "spline" }',
            ['connections."platform.wind_force.*".filter = "spline"', "'quintic'"],
        ),
        ('[connections]\n"platform.x" = { fom = "wind.y" }', ["fom", "did you mean 'from'"]),
        ('[connections]\n"platform" = { from = "wind.y" }', ["COMPONENT.VARIABLE"]),
    ],
)
def test_refusals(write: Write, text: str, words: list[str]) -> None:
    path = write(text)
    message = refusal(path)
    assert message.startswith(f"{path}: ")
    for word in words:
        assert word in message


def test_a_refused_setting_is_named_as_such(write: Write) -> None:
    path = write("[wind]\nspeed = 20")
    assert refusal(path, "wind.speed=-1").startswith("override: wind.speed = -1")
    assert refusal(path, "wind.sped=1").startswith("override: wind.sped")


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("[wind]\nspeed 20\n", 2, "Expected '='"),
        ("[wind]\nspeed = 20\nspeed = 21", 3, "Cannot overwrite"),
        ("\n\n[wind\nspeed = 20", 3, "Expected ']'"),
        ("[wind]\nspeed = 20 kn\n", 2, "Expected newline"),
    ],
)
def test_bad_toml_is_told_with_its_line(write: Write, text: str, line: int, reason: str) -> None:
    message = refusal(write(text))
    assert f"storm.toml, line {line}: not valid TOML: {reason}" in message


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    assert "no such scenario file" in refusal(tmp_path / "none.toml")
    assert "cannot be read" in refusal(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    assert "UTF-8" in refusal(binary)


# Steps


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["components.wind.step=0.75"], ["components.wind.step = 0.75", "0.1 s of 'platform'", "0.7 or 0.8 s"]),
        (["components.wind.step=7"], ["3598 or 3605 s", "components.wind.step to 6 or 7.2 s"]),
        (["simulation.duration=3600.03"], ["simulation.duration = 3600.03", "3600 or 3601 s"]),
        (["simulation.duration=0.5"], ["simulation.duration = 0.5", "give 1 s"]),
        (["components.wind.step=1e-10"], ["components.wind.step", "whole number of nanoseconds"]),
        (["simulation.duration=0.3333333333"], ["simulation.duration", "whole number of nanoseconds"]),
    ],
)
def test_steps_that_do_not_fit_are_told_with_the_nearest_that_do(
    write: Write, overrides: list[str], words: list[str]
) -> None:
    message = refusal(write(""), *overrides)
    for word in words:
        assert word in message


@given(st.integers(1, 60), st.integers(1, 60), st.integers(1, 60), st.integers(1, 400))
def test_steps_fit_exactly_when_they_divide(wind: int, wave: int, platform: int, duration: int) -> None:
    """Steps in units of 0.05 s, which no binary fraction holds exactly, against rational arithmetic."""
    steps = {"wind": wind, "wave": wave, "platform": platform}
    unit = Fraction(1, 20)
    smallest = min(steps.values())
    fits = all(step % smallest == 0 and duration % step == 0 for step in steps.values())
    data = {
        "simulation": {"duration": float(duration * unit)},
        "components": {name: {"step": float(step * unit)} for name, step in steps.items()},
    }
    if fits:
        Scenario.from_dict(data)
    else:
        with pytest.raises(ScenarioError, match=r"whole number of steps|multiple of the smallest"):
            Scenario.from_dict(data)
