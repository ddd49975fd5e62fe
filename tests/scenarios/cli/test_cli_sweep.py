"""`tlpsim sweep`, and `info` and `report` of what it leaves."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from distributed import Client

from tlpsim.scenarios.sweep import execution
from tlpsim.scenarios.sweep.ledger import ledger
from tlpsim.scenarios.sweep.table import NAME, read_table

Command = Callable[..., tuple[int, str, str]]

SWEEP = """
title = "Two heights"
[set]
platform.hydrodynamics = "morison"
simulation.duration = 300
waves.drift = "none"
waves.drift_damping = false
[grid]
waves.significant_height = { values = [4, 6], probability = [0.9, 0.1] }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "heights.toml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def done(file: Path, client: Client, command: Command) -> Path:
    """Folder of a sweep that is done."""
    folder = file.parent / "out"
    code, _, error = command("sweep", file, "-o", folder)
    assert (code, error) == (0, "")
    return folder


def test_the_plan_is_shown_and_nothing_done(file: Path, command: Command) -> None:
    code, out, _ = command("sweep", file, "--dry-run")
    assert code == 0
    assert out.startswith("Two heights: 2 cases, 2 jobs: 2 in the frequency domain\n")
    assert "waves.significant_height: 4, 6" in out
    code, out, _ = command("sweep", file, "--dry-run", "--json")
    plan = json.loads(out)
    assert [case["probability"] for case in plan["cases"]] == [0.9, 0.1]
    assert sorted(path.name for path in file.parent.iterdir()) == ["heights.toml"]


def test_what_a_sweep_comes_to(done: Path, command: Command) -> None:
    assert (done / "report.html").stat().st_size > 1e5
    code, out, _ = command("info", done)
    assert code == 0
    assert "Two heights: 2 cases, 2 jobs: 2 done, 0 failed" in out
    assert "significant_height 6: " in out  # governs
    assert "fatigue, frequency domain: tension, tendon" in out
    code, out, _ = command("info", done, "--json")
    found = json.loads(out)
    assert (found["kind"], found["done"], found["failed"]) == ("sweep", 2, [])
    surge = next(each for each in found["extremes"] if each["signal"] == "platform.position.surge")
    levels = [each["level"]["value"] for each in surge["returns"]]
    table = read_table(done)
    assert levels == sorted(levels)
    assert levels[-1] > table.statistic("platform.position.surge", "expected_maximum").max()


def test_a_page_of_it_elsewhere(done: Path, command: Command, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    code, out, _ = command("report", done / NAME, "-o", page)
    assert code == 0
    assert out.startswith(f"report: {page}")
    assert page.read_text() == (done / "report.html").read_text()
    assert "give its folder alone" in command("report", done, done, "-o", page)[2]
    assert "--signal and --from are for results of runs" in command("report", done, "-o", page, "--from", "5")[2]


def test_failed_jobs_are_told_and_the_exit_code_says_so(
    file: Path, client: Client, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text(SWEEP.replace("[4, 6]", "[4, -6]"))
    code, out, error = command("sweep", file, "-o", file.parent / "out")
    assert (code, error) == (1, "")
    assert "1 done, 1 failed" in out
    assert "failed: case 1, frequency domain: " in out
    assert "waves.significant_height = -6: must be at least 0" in out


def test_ctrl_c_says_what_is_kept(
    file: Path, client: Client, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(execution, "stored", interrupted)
    code, _, error = command("sweep", file, "-o", file.parent / "out")
    assert code == 130
    assert error == "tlpsim: interrupted; 0 of 2 jobs are done and kept: the same command goes on\n"
    monkeypatch.undo()


@pytest.mark.parametrize(
    ("change", "options", "told"),
    [
        ("", [], "give a folder for its results: -o DIR"),
        ("", ["-o", "."], "holds files that are not of a sweep"),
        ("", ["-o", "out", "--set", "waves.significant_height=3"], "waves.significant_height varies in"),
        ("", ["-o", "out", "--set", "waves.height=3"], "override: waves.height: unknown key"),
        ("", ["-o", "out", "--workers", "0"], "workers is 0; it must be 1 or more"),
        ("[gird]", ["-o", "out"], "gird: unknown key (did you mean 'grid'?)"),
    ],
)
def test_bad_input_is_one_line(
    change: str, options: list[str], told: str, file: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(file.parent)
    file.write_text(SWEEP + change)
    code, out, error = command("sweep", file, *options)
    assert (code, out) == (2, "")
    assert error.startswith("tlpsim: error: ")
    assert told in error
    assert error.count("\n") == 1


def test_two_sweeps_cannot_write_into_one_folder(file: Path, command: Command) -> None:
    with ledger(file.parent / "out"):
        _, _, error = command("sweep", file, "-o", file.parent / "out")
    assert "another sweep is writing there" in error


def test_info_of_a_folder_without_a_sweep(tmp_path: Path, command: Command) -> None:
    code, _, error = command("info", tmp_path)
    assert code == 2
    assert "no such file; make one by `tlpsim sweep" in error
