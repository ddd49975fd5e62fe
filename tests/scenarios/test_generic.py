"""Systems without a platform: FMUs by themselves, system descriptions, and scenarios that become one."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tlpsim.fmus.build import built_in
from tlpsim.loads.errors import ScenarioError, TlpsimError
from tlpsim.orchestrator.system import System
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.generic import export, opened, run_system
from tlpsim.scenarios.results import ResultsError, open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario


def tlpsim(*arguments: object) -> str:
    """Output of a command that succeeds."""
    result = CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_a_scenario_as_a_package_gives_the_same_bits(scenario_file: Path, tmp_path: Path) -> None:
    scenario = Scenario.load(scenario_file)
    standard = run_scenario(scenario, tmp_path / "standard.h5")
    path = export(scenario, tmp_path / "short.ssp")
    with opened([str(path)]) as description:
        assert (description.name, description.start, description.stop) == ("Short", 0.0, 20.0)
        assert [(each.name, each.step) for each in description.system.components] == [
            ("wind", 10**9),
            ("wave", 5 * 10**8),
            ("platform", 10**8),
        ]
        again = run_system(description, tmp_path / "again.h5")
    assert again.components.keys() == standard.components.keys()
    for component in standard.components:
        assert again.signals(component) == standard.signals(component)
        assert again.components[component]["sha256"] == standard.components[component]["sha256"]
        for name in (f"{component}.{variable}" for variable in standard.signals(component)):
            assert again.signal(name).tobytes() == standard.signal(name).tobytes(), name


def test_fmus_of_the_command_line(chain: Path, tmp_path: Path) -> None:
    """b gets the flag of a, 1 N, from t = 0.1 s on: y = 1 - e^-t, with the step of 0.1 s."""
    told = tlpsim(
        "run", f"a={chain}", f"b={chain}", "--connect", "a.flag=b.u[1]", "--set", "a.flag_in=true", "--step", "0.1",
        "--step", "b=0.2", "--stop", "10", "-o", tmp_path / "r.h5",
    )  # fmt: skip
    assert "b.y[12]" in told
    assert "mean" in told
    assert "note: 5 inputs b.u[*] are not connected" in told
    results = open_results(tmp_path / "r.h5")
    assert results.time("a")[1] == 0.1
    assert results.time("b")[1] == 0.2
    np.testing.assert_allclose(results.signal("b.y[1]")[-1], 1.0 - 1.2**-50, rtol=0.01)
    assert results.title == "a, b"
    system = json.loads(results.attributes["system"])
    assert system["components"]["a"]["parameters"] == {"flag_in": True}
    assert system["connections"][0]["target_variable"] == "u[1]"
    with pytest.raises(ResultsError, match="not one of a scenario"):
        _ = results.scenario
    assert "complete" in tlpsim("info", tmp_path / "r.h5")


def test_a_package_is_exported_and_run_by_the_command_line(tmp_path: Path, scenario_file: Path) -> None:
    told = tlpsim("export", scenario_file, "-o", tmp_path / "s.ssp", "--set", "outputs.statistics_from=0")
    assert told == f"system: {tmp_path / 's.ssp'}\n"
    told = tlpsim("run", tmp_path / "s.ssp", "-o", tmp_path / "r.h5", "--stop", "2 s", "--step", "platform=0.05")
    assert "platform.position.surge" in told
    assert len(open_results(tmp_path / "r.h5").time("platform")) == 41


def test_a_scenario_with_a_factor_on_a_connection(scenario_file: Path, tmp_path: Path) -> None:
    """Half the wind force in surge is another motion; the exported system has the same half."""
    halved = Scenario.load(scenario_file).with_(
        simulation={"duration": 5.0, "start": "rest"},
        connections={"platform.wind_force.surge": {"from": "wind.force.surge", "factor": 0.5}},
    )
    standard = run_scenario(halved, tmp_path / "standard.h5").signal("platform.position.surge")
    with opened([str(export(halved, tmp_path / "half.ssd"))]) as description:
        again = run_system(description, tmp_path / "again.h5").signal("platform.position.surge")
    whole = run_scenario(
        Scenario.load(scenario_file, ["simulation.duration=5", "simulation.start=rest"]), tmp_path / "w.h5"
    )
    assert again.tobytes() == standard.tobytes()
    assert abs(whole.signal("platform.position.surge")[-1] - standard[-1]) > 1e-3
    with pytest.raises(ScenarioError, match="a factor or an offset, which mean nothing in a monolithic run"):
        run_scenario(halved, tmp_path / "m.h5", monolithic=True)


FAULTS = {
    "no step": (["a.fmu"], "component 'a': its FMU has no default step; give one with --step 0.1 or --step a=0.1"),
    "no stop": (["a.fmu", "--step", "1"], "there is no default stop time; give one with --stop"),
    "twice": (["a.fmu", "a.fmu", "--step", "1"], "there are two components 'a'; name one of them: other=a.fmu"),
    "ending": (["a.xml"], "'a.xml' is neither a scenario (.toml), a system description (.ssp, .ssd) nor an FMU"),
    "two": (["a.ssp", "b.fmu"], "a system description stands alone; give one file"),
    "missing": (["a.ssp"], "a.ssp: no such file"),
    "step": (["a.fmu", "--step", "fast"], "--step is 'fast': "),
    "zero": (["a.fmu", "--step", "0"], "step of 'a': 0.0 s is not positive"),
    "whose step": (
        ["a.fmu", "--step", "1", "--step", "aa=1"],
        "--step: there is no component 'aa'; nearest match: 'a'",
    ),
    "form": (["a.fmu", "--step", "1", "--connect", "a.y[1]"], "'a.y[1]' is not of the form a.y=b.u"),
    "end": (["a.fmu", "--step", "1", "--connect", "y=a.u"], "'y' is not of the form COMPONENT.VARIABLE"),
    "component": (["a.fmu", "--step", "1", "--connect", "a.y=bc.u"], "--connect: there is no component 'bc'"),
    "variable": (
        ["a.fmu", "--step", "1", "--stop", "1", "--connect", "a.y[1]=a.v"],
        "component 'a' has no variable 'v'",
    ),
    "unit": (
        ["a.fmu", "--step", "1", "--stop", "1", "--connect", "a.y[1]=a.u[1]"],
        "the output is in m and the input in N",
    ),
    "parameter": (["a.fmu", "--step", "1", "--stop", "1", "--set", "a.w=1"], "no variable 'w' to set as a parameter"),
    "option": (["a.fmu", "--seed", "1"], "--monolithic, --seed and --duration are for scenarios"),
    "scenario": (["a.toml", "--stop", "1"], "are not for scenarios"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_one_line(chain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.fmu").write_bytes(chain.read_bytes())
    arguments, message = FAULTS[fault]
    result = CliRunner().invoke(app, ["run", *arguments, "-o", "r.h5"])
    assert isinstance(result.exception, TlpsimError)
    assert message in str(result.exception)
    assert "\n" not in str(result.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["a.fmu"]


def test_components_of_nested_systems_are_reached(chain: Path, tmp_path: Path) -> None:
    inner = f'<System name="inner"><Elements><Component name="b" source="{chain.name}"/></Elements></System>'
    (tmp_path / chain.name).write_bytes(chain.read_bytes())
    (tmp_path / "nested.ssd").write_text(
        '<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" '
        f'name="nested"><System name="root"><Elements>{inner}</Elements></System></SystemStructureDescription>'
    )
    settings = ["inner.b.u[1]=2.0", "inner.b.label=text"]
    wires = ["inner.b.count=inner.b.count_in"]
    with opened([str(tmp_path / "nested.ssd")], connect=wires, steps=["inner.b=0.5"], settings=settings) as description:
        assert isinstance(description.system, System)
        results = run_system(description, tmp_path / "r.h5", stop=5.0)
    assert results.signal("inner.b.y[1]")[-1] == pytest.approx(2.0 * (1.0 - 1.5**-10))


def test_built_in_fmus_need_no_scenario(tmp_path: Path) -> None:
    wind = built_in("wind", tmp_path)
    told = tlpsim("run", wind, "--step", "1", "--stop", "5", "--set", "wind.seed=3", "-o", tmp_path / "r.h5")
    assert "wind.force.surge" in told


def test_the_examples_of_the_document_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parents[2]
    blocks = re.findall(r"```python\n(.*?)```", (root / "docs" / "systems.md").read_text(), re.DOTALL)
    assert len(blocks) == 2
    (tmp_path / "scenarios").mkdir()
    shutil.copy(root / "scenarios" / "typical_tlp.toml", tmp_path / "scenarios")
    monkeypatch.chdir(tmp_path)
    found: dict[str, Any] = {}
    for block in blocks:
        exec(block, found)
    # 500 v' = 2000 - 500 * 3.6 v, apart from what the coupling of the two rates adds
    np.testing.assert_allclose(found["speed"][-1], 2000.0 / 1800.0, rtol=1e-3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again.ssd", "resources", "scenarios", "storm.ssp"]
