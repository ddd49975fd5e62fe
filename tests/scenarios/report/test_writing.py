"""`tlpsim report`: a page of every kind of results, and one line for what cannot be one."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.scenarios.cli.main import main
from tlpsim.scenarios.report.content import report_document
from tlpsim.scenarios.report.document import Checks, Document, Table
from tlpsim.scenarios.results import Results, open_results
from tlpsim.scenarios.schema import Scenario


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Exit code, standard output and standard error of `tlpsim report` with some arguments."""

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["tlpsim", "report", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        told = capsys.readouterr()
        return int(end.value.code or 0), told.out, told.err

    return run


def sections(document: Document) -> list[str]:
    return [each.anchor for each in document.sections if each.blocks]


def test_a_system_without_a_scenario(
    written: Callable[..., Results], tmp_path: Path, command: Callable[..., tuple[int, str, str]]
) -> None:
    values = np.array([1.0, 2.0, 6.0, np.nan])
    results = written({"spring.y": values}, {"spring.y": "m/s2"}, wall_time=0.5)
    code, out, err = command(results.path, "-o", tmp_path / "r.html", "--signal", "spring.*")
    assert (code, err) == (0, "")
    assert f"report: {tmp_path / 'r.html'}" in out.replace("\n", "")
    assert list(tmp_path.iterdir()) == [tmp_path / "r.html"]
    document = report_document([results])
    assert sections(document) == ["summary", "series", "timing", "scenario", "origin"]
    assert document.scene is None
    table = next(block for block in document.sections[0].blocks if isinstance(block, Table))
    assert table.rows[0].heading == "spring.y"
    assert table.rows[0].cells == ("3.00000", "2.16025", "1.00000", "6.00000", "m/s²")


def test_an_unfinished_run_says_so(record: Results, tmp_path: Path) -> None:
    path = tmp_path / "storm.h5.part"
    path.write_bytes(record.path.read_bytes())
    with h5py.File(path, "a") as file:
        file.attrs["status"] = "running"
        file["platform"]["position.surge"].resize((2500,))  # 250 s of it
    document = report_document([open_results(path)])
    assert not document.complete
    assert document.status.startswith("incomplete: storm.h5.part ends at")
    assert "or was killed" in document.status
    checks = next(block for block in document.head if isinstance(block, Checks))
    assert checks.entries[0][0] is False


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"not HDF5", "is not an HDF5 file"),
        (None, "no such results file"),
    ],
)
def test_what_is_no_results_file(
    tmp_path: Path, command: Callable[..., tuple[int, str, str]], content: bytes | None, told: str
) -> None:
    path = tmp_path / "x.h5"
    if content is not None:
        path.write_bytes(content)
    code, _, err = command(path, "-o", tmp_path / "r.html")
    assert code == 2
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "r.html").exists()


def test_another_hdf5_file(tmp_path: Path, command: Callable[..., tuple[int, str, str]]) -> None:
    h5py.File(tmp_path / "x.h5", "w").close()
    code, _, err = command(tmp_path / "x.h5", "-o", tmp_path / "r.html")
    assert (code, len(err.strip().splitlines())) == (2, 1)


@pytest.mark.parametrize(
    ("output", "arguments", "told"),
    [
        ("nowhere/r.html", [], "there is no folder"),
        (".", [], "is a folder"),
        ("r.html", ["--from", "soon"], "--from"),
        ("r.html", ["--from", "-3"], "--from -3: must be 0 s or more"),
        ("r.html", ["--signal", "wave.*"], "--signal: 'wave.*' matches no signal"),
    ],
)
def test_bad_requests_are_one_line(
    written: Callable[..., Results],
    tmp_path: Path,
    command: Callable[..., tuple[int, str, str]],
    output: str,
    arguments: list[str],
    told: str,
) -> None:
    results = written({"spring.y": np.arange(4.0)})
    code, _, err = command(results.path, "-o", tmp_path / output, *arguments)
    assert code == 2
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(
    written: Callable[..., Results], tmp_path: Path, command: Callable[..., tuple[int, str, str]]
) -> None:
    tmp_path.chmod(0o500)
    code, _, err = command(written({"spring.y": np.arange(4.0)}).path, "-o", tmp_path / "r.html")
    tmp_path.chmod(0o700)
    assert (code, len(err.strip().splitlines())) == (2, 1)


def test_records_and_cases_in_one_page(written: Callable[..., Results], storm: Scenario) -> None:
    """Two records of one case, and another scenario without waves, of which the frequency domain says nothing."""
    time = np.arange(800) * 0.5
    position = {f"platform.position.{name}": np.sin(0.6 * time + k) for k, name in enumerate(("surge", "sway"))}
    units = dict.fromkeys(position, "m")
    vendor = storm.with_(components={"wave": {"fmu": "vendor.fmu"}})
    files = [
        written(position, units, vendor.with_(simulation={"seed": 1})),
        written(position, units, vendor.with_(simulation={"seed": 2})),
        written(position, units, vendor.with_(wind={"speed": 40.0})),
    ]
    document = report_document(files)
    assert document.title == "By hand"
    assert "3 records of" in document.subtitle
    assert "speed 26.9; speed 40" in document.subtitle
    series = next(section for section in document.sections if section.anchor == "series").blocks[0]
    labels = [each["label"] for each in series.content["records"]]  # type: ignore[union-attr]
    assert labels == ["speed 26.9, seed 1", "speed 26.9, seed 2", "speed 40"]
    json.dumps(series.content, allow_nan=False)  # type: ignore[union-attr]
    words = " ".join(getattr(block, "text", "") for block in document.sections[0].blocks)
    assert "speed 40: The frequency domain stands aside" in words
