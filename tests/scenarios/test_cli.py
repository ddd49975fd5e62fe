"""The command line in processes of its own: what a user sees, and exit codes."""

import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from time import monotonic, sleep

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


def test_ctrl_c_keeps_the_samples_so_far(scenario_file: Path, tmp_path: Path) -> None:
    output = tmp_path / "r.h5"
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", "run", str(scenario_file), "-o", str(output)]
    running = subprocess.Popen([*command, "--duration", "1000000"], stderr=subprocess.PIPE, text=True)
    part = output.with_name("r.h5.part")
    deadline = monotonic() + 120.0
    while not part.exists() and running.poll() is None and monotonic() < deadline:
        sleep(0.1)
    sleep(0.5)
    running.send_signal(signal.SIGINT)
    _, told = running.communicate(timeout=60)
    assert running.returncode == 130
    assert told.strip() == f"tlpsim: interrupted; the samples so far are in {part}"
    assert not output.exists()


def test_two_processes_give_the_same_bytes(scenario_file: Path, tmp_path: Path) -> None:
    from tlpsim.scenarios.results import open_results

    for name in ("a.h5", "b.h5"):
        assert tlpsim("run", scenario_file, "-o", tmp_path / name).returncode == 0
    one, other = open_results(tmp_path / "a.h5"), open_results(tmp_path / "b.h5")
    for component in one.components:
        for variable in one.signals(component):
            name = f"{component}.{variable}"
            assert one.signal(name).tobytes() == other.signal(name).tobytes()
