"""A vendor's FMU in the place of one of ours: what `tlpsim swap` says of it, and a run with what it writes."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from tlpsim.fmus.build import build
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import summary
from tlpsim.scenarios.swap import swap, write_scenario
from tlpsim.scenarios.writing import to_toml

SCRIPT = Path(__file__).with_name("vendor_platform.py")


@pytest.fixture(scope="session")
def vendor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stand-in for a vendor's platform, in kN and degrees."""
    folder = tmp_path_factory.mktemp("vendor")
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(SCRIPT), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return folder / "VendorPlatform.fmu"


def tlpsim(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(map(str, arguments)))
    return result.exit_code, result.output


def test_names_and_units_are_found(vendor: Path) -> None:
    found = swap(Scenario.from_dict({}), "platform", vendor)
    by_name = {fit.variable: fit for fit in found.fits}
    axes = ("x", "y", "z", "phi", "theta", "psi")
    loads = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
    for degree, axis, load in zip(DEGREES_OF_FREEDOM, axes, loads, strict=True):
        assert by_name[f"wind_force.{degree}"].match == f"windLoad.{load}"
        assert by_name[f"wave_force.{degree}"].match == f"hydroLoad.{load}"
        assert by_name[f"position.{degree}"].match == f"pos.{axis}"
        assert by_name[f"velocity.{degree}"].match == f"vel.{axis}"
    assert by_name["wind_force.surge"].unit == "N → kN, × 0.001"
    assert by_name["position.yaw"].unit == "deg → rad, × 0.0174533"
    assert not by_name["acceleration.surge"].match
    assert not by_name["acceleration.surge"].needed
    assert found.faults == ()
    assert found.extra == ()
    notes = "\n".join(found.notes)
    for text in ("acceleration.*", "tendon_tension[*]", "no iteration of its loop; no checkpoints", "by a line"):
        assert text in notes


def test_swapped_in_by_what_is_written(vendor: Path, tmp_path: Path) -> None:
    """Wind and waves drive the vendor's oscillators; their own equations give the same motion."""
    base = tmp_path / "base.toml"
    base.write_text(
        'title = "Vendor"\n[simulation]\nduration = 60.0\n[waves]\ncomponents = 20\n[outputs]\nstatistics_from = 0.0\n'
    )
    code, told = tlpsim("swap", base, "platform", vendor, "--write", tmp_path / "swapped.toml")
    assert code == 0, told
    assert "It fits" in told
    with pytest.warns(UserWarning, match="the FMU has no parameters damping_ratio.surge"):
        results = run_scenario(Scenario.load(tmp_path / "swapped.toml"), tmp_path / "r.h5")
    assert results.unit("platform.position.yaw") == "deg"
    assert "position.surge" in results.signals("platform")
    spec = importlib.util.spec_from_file_location("vendor_platform", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    model = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(model)
    for i, degree in ((0, "surge"), (5, "yaw")):

        def force(time: float, degree: str = degree) -> float:
            return sum(
                float(np.interp(time, results.time(name), results.signal(f"{name}.force.{degree}")))
                for name in ("wind", "wave")
            )

        def equation(time: float, state: np.ndarray, i: int = i) -> list[float]:
            load = force(time) - model.DAMPING[i] * state[1] - model.STIFFNESS[i] * state[0]
            return [state[1], load / model.MASS[i]]

        times = results.time("platform")
        exact = solve_ivp(equation, (0.0, 60.0), [0.0, 0.0], max_step=0.25, rtol=1e-7, t_eval=times).y[0]
        found = results.signal(f"platform.position.{degree}") * (1.0 if i < 3 else np.pi / 180.0)
        # a line between the samples of the forces is not the filter of the connections
        np.testing.assert_allclose(found, exact, atol=5e-3 * np.ptp(exact))
    # the table of the summary is in rad, whatever the FMU gives
    yaw = next(row for row in summary(results).motions if row.name == "yaw")
    assert yaw.maximum == pytest.approx(1e2 * np.radians(results.signal("platform.position.yaw").max()))


def test_what_is_missing_is_told(vendor: Path, tmp_path: Path) -> None:
    """A platform in the place of the waves: inputs and outputs the wrong way round."""
    code, told = tlpsim("swap", _short(tmp_path), "wave", vendor)
    assert code == 1
    assert "error: force.* is missing, and the scenario connects it" in told
    assert "It does not fit" in told


def test_our_own_fits_without_a_map(tmp_path: Path) -> None:
    found = swap(Scenario.from_dict({}), "wind", build(tmp_path, ["wind"])[0])
    assert found.faults == ()
    assert all(fit.exact for fit in found.fits)
    assert "map" not in found.changes["components"]["wind"]
    assert any("checkpoints" in note and "no checkpoints" not in note for note in found.notes)


def test_errors_are_one_line(vendor: Path, tmp_path: Path) -> None:
    scenario = Scenario.from_dict({})
    with pytest.raises(ScenarioError, match=r"no contract of a component 'platfrom' \(did you mean 'platform'\?\)"):
        swap(scenario, "platfrom", vendor)
    base = _short(tmp_path)
    found = swap(scenario, "platform", vendor)
    write_scenario(found, base, tmp_path / "new.toml")
    with pytest.raises(ScenarioError, match=r"new.toml: the file exists already; give another name"):
        write_scenario(found, base, tmp_path / "new.toml")


def test_toml_of_a_scenario_is_read_back(tmp_path: Path) -> None:
    import tomllib

    data = {
        "title": 'with "quotes" and °',
        "wind": {"speed": 3.5, "boxes": [{"position": [0.0, 1.0, 40.0], "size": [1, 2, 3]}], "yaw": True},
        "components": {"a-b": {"fmu": "x.fmu", "map": {"force.surge": "f[0]"}, "parameters": {}}},
        "connections": {"a.u": {"from": "b.y", "factor": 1e-8}},
    }
    assert tomllib.loads(to_toml(data)) == data


def _short(folder: Path) -> Path:
    path = folder / "short.toml"
    path.write_text('title = "Short"\n[simulation]\nduration = 20.0\n')
    return path
