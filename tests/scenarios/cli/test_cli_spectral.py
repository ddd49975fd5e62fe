"""The commands of the frequency domain as a user gives them; where no solver is asked for, on a fake response."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep

import pytest

from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.cli.main import main
from tlpsim.scenarios.compare_figures import CONTRIBUTIONS, SPECTRA, SURGE

Run = Callable[..., tuple[int, str, str]]
SHORT = """
title = "Short"
[simulation]
duration = 100.0
[outputs]
statistics_from = 10.0
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture
def tlpsim(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    fake_response: Callable[..., SpectralResponse],
) -> Run:
    """Exit code, output and errors of a command in this process, where the solver is a fake."""
    monkeypatch.setattr("tlpsim.scenarios.spectral.spectral_response", lambda scenario: fake_response())

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["tlpsim", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        told = capsys.readouterr()
        code = end.value.code
        return (0 if code is None else int(code)), told.out, told.err

    return run


def test_spectral_and_info(tlpsim: Run, scenario: Path, tmp_path: Path) -> None:
    file = tmp_path / "s.h5"
    code, told, _ = tlpsim("spectral", scenario, "-o", file, "--duration", "3h", "--set", "wind.speed=20")
    assert code == 0
    for words in (
        "Short: frequency domain",
        "surge, m",
        "1e-2 rad",
        "top, tendon 1",
        "bottom, tendon 2",
        "natural modes",
        "102.000",
        "mean loads",
        "loads 0.10, solution 0.20; together 0.30",
        f"response: {file}",
    ):
        assert words in told
    assert told.split().count("3") >= 4  # in 3 h
    code, shown, _ = tlpsim("info", file)
    assert code == 0
    assert "tlpsim spectral response of" in shown
    assert told.partition("response: ")[0] in shown


def test_compare_and_its_figures(tlpsim: Run, scenario: Path, tmp_path: Path) -> None:
    """Real records in this process: two of 100 s."""
    file = tmp_path / "c.h5"
    code, told, _ = tlpsim("compare", scenario, "--records", 2, "--workers", 1, "-o", file, "--paper")
    assert code == 0
    for words in (
        "2 records of 100 s",
        "7.55",
        "the paper's inputs are not published",
        "one loop",
        f"comparison: {file}",
    ):
        assert words in told
    code, shown, _ = tlpsim("info", file)
    assert code == 0
    assert "2 records of 100 s" in shown

    code, told, _ = tlpsim("figures", "compare", "-o", tmp_path / "f", "--comparison", file, "--scenario", scenario)
    assert code == 0
    assert [Path(line).name for line in told.split()] == [SPECTRA, SURGE, CONTRIBUTIONS]
    assert {path.name for path in (tmp_path / "f").iterdir()} == {SPECTRA, SURGE, CONTRIBUTIONS}
    other = ("figures", "compare", "-o", tmp_path / "g", "--comparison", file, "--scenario", scenario)
    code, _, error = tlpsim(*other, "--set", "wind.speed=5")
    assert code == 2
    assert "another scenario" in error
    assert not (tmp_path / "g").exists()


def test_json_is_all_that_is_printed(tlpsim: Run, scenario: Path, tmp_path: Path) -> None:
    command = ("compare", scenario, "--records", 2, "--workers", 1, "--json", "-o", tmp_path / "c.h5", "--cosimulation")
    code, told, _ = tlpsim(*command)
    assert code == 0
    assert json.loads(told)["cosimulation"] is True
    code, told, error = tlpsim(
        "sensitivity", scenario, "--parameters", "wind.speed", "--json", "--workers", 1, "-o", tmp_path / "s.csv"
    )
    assert code == 0
    assert {row["change"] for row in json.loads(told)["rows"]} == {"-10 %", "+10 %"}
    assert f"sensitivity: {tmp_path / 's.csv'}" in error


def test_sensitivity(tlpsim: Run, scenario: Path, tmp_path: Path) -> None:
    chosen = ("--parameters", "wind.speed, waves.heading_deg,platform.tendons.axial_stiffness", "--change", "5%")
    code, told, _ = tlpsim(
        "sensitivity", scenario, *chosen, "--turn", "3", "--workers", 1, "--figure", tmp_path, "-o", tmp_path / "s.h5"
    )
    assert code == 0
    for words in ("what ±5 %, ±3° of one key does", "waves.heading_deg", "tendons.axial_stiffness", "sensitivity.png"):
        assert words in told
    assert (tmp_path / "sensitivity.png").exists()
    assert (tmp_path / "s.h5").exists()


BAD = {
    "no scenario": ("spectral", "none.toml"),
    "folder for a response": ("spectral", "short.toml", "-o", "."),
    "key": ("spectral", "short.toml", "--set", "waves.hs=3"),
    "records": ("compare", "short.toml", "--records", "0"),
    "workers": ("compare", "short.toml", "--workers", "0"),
    "short records": ("compare", "short.toml", "--duration", "50"),
    "folder for a comparison": ("compare", "short.toml", "-o", "."),
    "change": ("sensitivity", "short.toml", "--change", "much"),
    "turn": ("sensitivity", "short.toml", "--turn", "3 m"),
    "suffix": ("sensitivity", "short.toml", "-o", "s.txt"),
    "parameter": ("sensitivity", "short.toml", "--parameters", "wind.nonsense"),
    "all and some": ("sensitivity", "short.toml", "--all", "--parameters", "wind.speed"),
    "nothing to draw": ("figures", "compare", "-o", "f"),
    "no comparison": ("figures", "compare", "-o", "f", "--comparison", "short.toml"),
    "comparison of processes": ("figures", "processes", "-o", "f", "--comparison", "c.h5"),
}


@pytest.mark.parametrize("case", BAD)
def test_an_error_is_one_line_with_exit_code_2(
    tlpsim: Run, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, error = tlpsim(*BAD[case])
    assert code == 2
    assert error.startswith("tlpsim: error: ")
    assert len(error.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["short.toml"]


@pytest.fixture
def endless(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listening: Callable[[], None]
) -> Iterator[subprocess.Popen[bytes]]:
    """A comparison of hours in a process group of its own, as a terminal makes one."""
    monkeypatch.setenv("FORCE_COLOR", "1")  # draws the progress bar, which tells when to interrupt
    command = [sys.executable, "-m", "tlpsim.scenarios.cli", "compare", str(scenario), "-o", str(tmp_path / "c.h5")]
    command += ["--records", "5000", "--workers", "2"]
    opening = {"stderr": subprocess.PIPE, "start_new_session": True, "preexec_fn": listening}
    with subprocess.Popen(command, **opening) as running:
        yield running
        with suppress(ProcessLookupError):
            os.killpg(running.pid, signal.SIGKILL)


def test_ctrl_c_ends_all_processes(endless: subprocess.Popen[bytes], tmp_path: Path) -> None:
    assert endless.stderr is not None
    seen = b""
    while b"of 5000 records" not in seen:
        new = os.read(endless.stderr.fileno(), 4096)
        assert new, seen
        seen += new
    os.killpg(endless.pid, signal.SIGINT)
    _, told = endless.communicate(timeout=60)
    assert endless.returncode == 130
    assert told.endswith(b"tlpsim: interrupted; nothing was written\n")
    assert b"Traceback" not in seen + told
    deadline = monotonic() + 30.0
    with suppress(ProcessLookupError):  # of the group: it is empty
        while monotonic() < deadline:
            os.killpg(endless.pid, 0)
            sleep(0.1)
        pytest.fail("a process is left")
    assert [path.name for path in tmp_path.iterdir()] == ["short.toml"]
