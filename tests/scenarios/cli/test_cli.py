"""The command line in processes of its own: what a user sees, and exit codes."""

import os
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest


def tlpsim(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_build_run_check_info(scenario_file: Path, tmp_path: Path) -> None:
    built = tlpsim("build", "-o", tmp_path / "fmus")
    assert built.returncode == 0
    assert sorted(path.name for path in (tmp_path / "fmus").iterdir()) == ["platform.fmu", "wave.fmu", "wind.fmu"]

    checked = tlpsim("check", scenario_file)
    assert checked.returncode == 0
    assert "The scenario is valid" in checked.stdout

    ran = tlpsim("run", scenario_file, "-o", tmp_path / "r.h5", "--duration", "100", "--seed", "3")
    assert ran.returncode == 0, ran.stderr
    for word in ("surge, m", "heave, cm", "yaw, 1e-2 rad", "tension: maximum"):
        assert word in ran.stdout

    for file, word in ((tmp_path / "r.h5", "seeds: wind"), (tmp_path / "fmus" / "wave.fmu", "significant_height")):
        told = tlpsim("info", file)
        assert told.returncode == 0
        assert word in told.stdout


BAD = {
    "unknown key": ["--set", "waves.hs=3"],
    "no TOML": ["--set", "nonsense"],
    "missing FMU": ["--set", "components.wave.fmu=nowhere.fmu"],
    "corrupted zip": ["--set", "components.wave.fmu=corrupted.fmu"],
    "step": ["--set", "components.wave.step=0.35"],
    "parameter of a component": ["--set", "components.wind.parameters.roughness=-1.0"],
}


@pytest.mark.parametrize("case", BAD)
def test_an_error_is_one_line_with_exit_code_2(scenario_file: Path, tmp_path: Path, case: str) -> None:
    (tmp_path / "corrupted.fmu").write_bytes(b"PK\x03\x04 no archive")
    before = sorted(tmp_path.iterdir())
    done = tlpsim("run", scenario_file, "-o", tmp_path / "r.h5", *BAD[case])
    assert done.returncode == 2
    assert done.stderr.startswith("tlpsim: error: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr + done.stdout
    assert sorted(tmp_path.iterdir()) == before


def test_check_initializes_the_fmus(scenario_file: Path, tmp_path: Path) -> None:
    """An FMU built with another version is found without a run."""
    from tlpsim.fmus.build import build

    path = build(tmp_path, ["wave"])[0]
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(tmp_path / "old.fmu", "w") as old:
        for name in archive.namelist():
            data = archive.read(name)
            old.writestr(name, b'{"version": "0.0.1", "bundled": false}' if name.endswith("tlpsim.json") else data)
    done = tlpsim("check", scenario_file, "--set", "components.wave.fmu=old.fmu")
    assert done.returncode == 2
    assert "built with tlpsim 0.0.1" in done.stderr
    assert "tlpsim build" in done.stderr


def test_a_missing_scenario_and_a_folder_for_results(scenario_file: Path, tmp_path: Path) -> None:
    assert tlpsim("check", tmp_path / "none.toml").returncode == 2
    assert "is a folder" in tlpsim("run", scenario_file, "-o", tmp_path).stderr


def test_two_processes_give_the_same_bytes(scenario_file: Path, tmp_path: Path) -> None:
    from tlpsim.scenarios.results import open_results

    for name in ("a.h5", "b.h5"):
        assert tlpsim("run", scenario_file, "-o", tmp_path / name).returncode == 0
    one, other = open_results(tmp_path / "a.h5"), open_results(tmp_path / "b.h5")
    for component in one.components:
        for variable in one.signals(component):
            name = f"{component}.{variable}"
            assert one.signal(name).tobytes() == other.signal(name).tobytes()


HULL = """
[hull]
kind = "box"
length = 20.0
beam = 10.0
draft = 5.0
panel = 5.0
"""


@pytest.fixture
def hull_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A hull of few panels, and a cache of its own for the processes of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "hull.toml"
    path.write_text(HULL)
    return path


def test_bem_info_figures(hull_file: Path, tmp_path: Path) -> None:
    output = tmp_path / "hydro.h5"
    command = ("bem", hull_file, "-o", output, "--omega", "0.4:0.8:2", "--headings", "0,45", "--depth", "60")
    first = tlpsim(*command)
    assert first.returncode == 0, first.stderr
    for word in ("depth 60 m", "0, 45°", "volume 1000 m³", "A(∞)", "largest B", "± %", "asymmetry", f"{output}"):
        assert word in first.stdout
    assert "from the cache" not in first.stdout
    bytes_before = output.read_bytes()
    output.unlink()
    second = tlpsim(*command)
    assert second.returncode == 0
    assert "from the cache" in second.stdout
    assert output.read_bytes() == bytes_before

    told = tlpsim("info", output)
    assert told.returncode == 0
    assert "hydrodynamic database" in told.stdout
    assert "volume 1000 m³" in told.stdout

    drawn = tlpsim("figures", "hydro", "-o", tmp_path / "figures", "--database", output)
    assert drawn.returncode == 0, drawn.stderr
    assert {path.name for path in (tmp_path / "figures").iterdir()} >= {"added_mass.png", "mean_drift.png", "mesh.png"}
    assert not list(tmp_path.glob("*.part"))


def test_bem_makes_a_quadratic_transfer_function(hull_file: Path, tmp_path: Path) -> None:
    qtf = tmp_path / "new" / "qtf.h5"
    command = ("bem", hull_file, "-o", tmp_path / "hydro.h5", "--omega", "0.4:0.8:2", "--headings", "0,45")
    made = tlpsim(*command, "--qtf", qtf)
    assert made.returncode == 0, made.stderr
    told = tlpsim("info", qtf)
    assert told.returncode == 0, told.stderr
    for words in ("two waves of one heading", "0.4, 0.8 rad/s", "0, 45°", "potential of second order is left out"):
        assert words in " ".join(made.stdout.split())
        assert words in " ".join(told.stdout.split())
    assert f"quadratic transfer function: {qtf}" in made.stdout
    assert "off the database's, %" in " ".join(made.stdout.replace("┃", " ").split())


BAD_HULLS = {
    "no file": ["none.toml"],
    "no hull": ["none.gdf"],
    "omega": ["hull.toml", "--omega", "0.5:"],
    "headings": ["hull.toml", "--headings", "north"],
    "depth": ["hull.toml", "--depth", "4"],
    "rho": ["hull.toml", "--rho", "0"],
    "panel": ["hull.toml", "--panel", "-1"],
    "symmetry": ["hull.toml", "--symmetry", "x"],
    "folder": ["hull.toml", "-o", "."],
    "options without a file": ["hull.toml", "--qtf-pairs"],
    "one frequency": ["hull.toml", "--omega", "0.5", "--qtf", "qtf.h5"],
    "broken": ["broken.gdf"],
}


@pytest.mark.parametrize("case", BAD_HULLS)
def test_bem_tells_what_is_wrong_and_leaves_nothing(
    hull_file: Path, tmp_path: Path, case: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from tlpsim.scenarios.cli.main import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.gdf").write_text("one panel\n1 9.81\n0 0\n1\n0 0 -1  1 0 -1  1 1 -1  0 1 -1\n")
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(sys, "argv", ["tlpsim", "bem", "-o", "hydro.h5", *BAD_HULLS[case]])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    told = capsys.readouterr().err
    assert told.startswith("tlpsim: error: ")
    assert len(told.strip().splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


def test_bem_warns_and_goes_on(hull_file: Path, tmp_path: Path) -> None:
    done = tlpsim("bem", hull_file, "-o", tmp_path / "hydro.h5", "--omega", "2.5", "--no-lid")
    assert done.returncode == 0
    warnings = [line for line in done.stderr.splitlines() if line.startswith("tlpsim: warning: ")]
    assert len(warnings) == len(done.stderr.splitlines()) == 2
    assert "panels below" in warnings[0]


def test_ctrl_c_in_bem_leaves_nothing(
    hull_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listening: Callable[[], None]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # draws the progress bar, which tells when to interrupt
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", "bem", str(hull_file), "-o", str(tmp_path / "hydro.h5")]
    before = sorted(tmp_path.iterdir())
    command += ["--omega", "0.1:1.0:5000", "--panel", "1"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, preexec_fn=listening)
    assert running.stderr is not None
    seen = b""
    while b"of 5000 frequencies" not in seen:
        new = os.read(running.stderr.fileno(), 4096)
        assert new, seen
        seen += new
    running.send_signal(signal.SIGINT)
    _, told = running.communicate(timeout=60)
    assert running.returncode == 130
    assert told.endswith(b"tlpsim: interrupted; nothing was written\n")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "word"),
    [(["hydro", "--scenario", "a.toml"], "--database"), (["processes", "--database", "a.h5"], "--scenario")],
)
def test_figures_of_one_set_take_their_own_file(arguments: list[str], word: str, tmp_path: Path) -> None:
    done = tlpsim("figures", *arguments, "-o", tmp_path / "figures")
    assert done.returncode == 2
    assert word in done.stderr
    assert not (tmp_path / "figures").exists()
