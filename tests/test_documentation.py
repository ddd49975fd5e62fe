"""What the documents say exists, and what they show runs: links, commands, files, and every block of code.

How blocks are run, and how they are kept quick, stands in `tests/documents/document_runner.py`; blocks that take
minutes run with `pytest -m validation`.
"""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import document_runner
import numpy as np
import pytest
import typer
from document_blocks import RUN, Block, blocks
from typer.testing import CliRunner

from tlpsim.orchestrator.table import write_table
from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import summary

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
DOCUMENTS = [*PAGES, ROOT / "CHANGELOG.md"]
LINK = re.compile(r"\[[^\]]+\]\(([^)#\s]+)(?:#[^)]*)?\)")
SCRIPT = re.compile(r"\b((?:benchmarks|scenarios|docs|tests|loads|fmus|orchestrator)/[\w/.-]+\.(?:py|toml|md))\b")
NOT_RUN = {"README.md": 1, "tutorial.md": 1, "sweeps.md": 1}
"""Blocks that no test can run, by page: those that make the environment in which the tests run, and a cluster."""


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_links_and_named_files_exist(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    targets = [t for t in LINK.findall(text) if "://" not in t]
    missing = [t for t in targets if not (document.parent / t).exists()]
    missing += [f for f in SCRIPT.findall(text) if not (ROOT / f).exists()]
    assert not missing


COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_commands_in_code_exist(document: Path) -> None:
    """Those in the text, too, which no test runs."""
    code = re.findall(r"```(?:sh|console|bash)\n(.*?)```|`(tlpsim [^`]+)`", document.read_text(), re.DOTALL)
    named = {match.group(1) for block in code for match in re.finditer(r"(?:^|\s)tlpsim ([a-z]+)", "\n".join(block))}
    assert named <= set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str) -> None:
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    assert len(result.output.splitlines()) > 5


# Blocks of code


@pytest.fixture(scope="session")
def reader_files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files that the documents suppose their reader to have: FMUs, a table, the results of a storm."""
    folder = tmp_path_factory.mktemp("reader")
    scripts = {"vendor.fmu": ROOT / "tests/scenarios/vendor_platform.py", "a.fmu": ROOT / "tests/documents/lag.py"}
    files = {"load.csv": folder / "load.csv", "storm.h5": folder / "storm.h5"}
    for file, script in scripts.items():
        target = folder / file.removesuffix(".fmu")
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(target)]
        subprocess.run(command, check=True, capture_output=True, cwd=folder)
        (files[file],) = target.glob("*.fmu")
    time = np.arange(0.0, 20.0, 0.5)
    write_table(files["load.csv"], time, {"y": np.sin(time)}, {"y": "1"})
    short = [f"simulation.duration={document_runner.SHORT_RUN}", "outputs.statistics_from=20"]
    run_scenario(Scenario.load(ROOT / "scenarios" / "typical_tlp.toml", short), files["storm.h5"])
    return files | {"b.fmu": files["a.fmu"]}


def runnable(page: Path, marks: tuple[str, ...]) -> list[Block]:
    return [block for block in blocks(page) if block.mark in marks]


WITH_CODE = [page for page in PAGES if runnable(page, ("", "long"))]
LONG = [page for page in PAGES if runnable(page, ("long",))]


@pytest.fixture
def run_page(
    tmp_path: Path, reader_files: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> Callable[[list[Block]], None]:
    """Runner of the blocks of one page, in a folder of its own, which is the working folder."""
    page = document_runner.Page(tmp_path, reader_files)
    monkeypatch.chdir(tmp_path)

    def run(found: list[Block]) -> None:
        for block in found:
            page.run(block)

    return run


@pytest.mark.parametrize("page", WITH_CODE, ids=name)
def test_code_runs(page: Path, run_page: Callable[[list[Block]], None]) -> None:
    run_page(runnable(page, ("",)))


@pytest.mark.validation
@pytest.mark.parametrize("page", LONG, ids=name)
def test_long_code_runs(page: Path, run_page: Callable[[list[Block]], None]) -> None:
    run_page(runnable(page, ("", "long")))


@pytest.mark.validation
def test_the_response_that_is_shown_is_that_of_the_default_storm(tmp_path: Path) -> None:
    """The table in README.md and in the tutorial, to the digits that another machine may round differently."""
    storm = Scenario.load(ROOT / "scenarios" / "typical_tlp.toml")
    motions = {f"{row.name}, {row.unit}": row for row in summary(run_scenario(storm, tmp_path / "r.h5")).motions}
    for page in (ROOT / "README.md", ROOT / "docs" / "tutorial.md"):
        shown = re.findall(r"^│ (\w+, [^│]*?) *│(.*)│$", page.read_text(encoding="utf-8"), re.MULTILINE)
        assert [label for label, _ in shown] == list(motions), page.name
        for label, cells in shown:
            row = motions[label]
            found = row.mean, row.low_frequency, row.wave_frequency, row.std, row.minimum, row.maximum
            assert [float(cell) for cell in cells.split("│")] == pytest.approx(found, rel=1e-3, abs=2e-3), label


def test_few_blocks_are_not_run() -> None:
    """Each of them with a reason, which `blocks` asks for."""
    assert Counter(block.page.name for page in PAGES for block in runnable(page, ("not run",))) == NOT_RUN


# The runner itself


def page_of(tmp_path: Path, text: str) -> Path:
    page = tmp_path / "page.md"
    page.write_text(text)
    return page


def test_blocks_are_found_with_their_marks(tmp_path: Path) -> None:
    text = 'Text.\n\n```sh\na\n```\n\n<!-- long: minutes -->\n```python\nb\n```\n```toml title="c.toml"\nd = 1\n```\n'
    found = blocks(page_of(tmp_path, text))
    assert [(each.language, each.text, each.mark, each.file, each.line) for each in found] == [
        ("sh", "a\n", "", "", 3),
        ("python", "b\n", "long", "", 8),
        ("toml", "d = 1\n", "", "c.toml", 11),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("```\na\n```\n", "give it one of the languages"),
        ("<!-- not run: -->\n```sh\na\n```\n", "without a reason"),
        ("<!-- long: minutes -->\n\n```sh\na\n```\n", "stands on no block"),
    ],
)
def test_blocks_that_a_test_would_miss_are_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        blocks(page_of(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("```sh\ntlpsim info nothing.h5\n```\n", "no such results file"),
        ("```sh\nls | grep nothing\n```\n", "exit code 1"),
        ("```sh\ntlpsim info nothing.h5 | cat\n```\n", "no such results file"),
        ("```python\nassert 1 == 2, 3\n```\n", "3"),
        ("```toml\n[wind]\nsped = 1\n```\n", "unknown key"),
        ("```json\n{\n```\n", "Expecting"),
    ],
)
def test_code_that_fails_is_found(
    tmp_path: Path, run_page: Callable[[list[Block]], None], text: str, words: str
) -> None:
    with pytest.raises(Exception, match=words):
        run_page(blocks(page_of(tmp_path, text)))


def test_shell_blocks_are_taken_apart() -> None:
    text = "# comment\na \\\n  b   # behind\n\nc && d\n"
    assert [each.split() for each in document_runner.statements(text)] == [["a", "b", "#", "behind"], ["c"], ["d"]]
    quoted, piped = "tlpsim info r.h5 --signal 'a.*'   # (all)", "tlpsim info r.h5 | head"
    assert [document_runner.needs_shell(each) for each in (quoted, piped, "ls *.h5")] == [False, True, True]
    assert list(document_runner.statements("cat > f <<E\nx\nE\ny\n")) == ["cat > f <<E\nx\nE\ny\n"]


def test_every_language_that_runs_is_shown() -> None:
    assert {block.language for page in PAGES for block in blocks(page)} >= {*RUN, "toml"}
