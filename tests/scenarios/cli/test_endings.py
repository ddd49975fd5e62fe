"""How commands end: exit codes, last words, signals, readers that go away, and what is said in a quiet command."""

import errno
import importlib.metadata
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep

import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.cli.endings import DEBUG, ExitCode, last_words
from tlpsim.scenarios.interruption import Terminated
from tlpsim.scenarios.results import ResultsError, open_results

Command = Callable[..., tuple[int, str, str]]
TLPSIM = [sys.executable, "-m", "tlpsim.scenarios.cli"]
ROOT = Path(__file__).parents[3]

LAST_WORDS: dict[str, tuple[BaseException, int, str]] = {
    "ours": (ScenarioError("waves.hs: no such key"), 2, "error: waves.hs: no such key"),
    "of two lines": (ScenarioError("no\n such key"), 2, "error: no such key"),
    "file": (PermissionError(errno.EACCES, "Permission denied", "a.h5"), 2, "error: a.h5: permission denied"),
    "no file": (OSError(errno.ENOSPC, "No space left on device"), 2, "error: no space left on device"),
    "memory": (MemoryError("Unable to allocate 9 TiB"), 2, "error: not enough memory: Unable to allocate 9 TiB"),
    "no word of it": (MemoryError(), 2, "error: not enough memory"),
    "Ctrl-C": (KeyboardInterrupt(), 130, "interrupted"),
    "SIGTERM": (Terminated(), 143, "terminated"),
}


@pytest.mark.parametrize("case", LAST_WORDS)
def test_last_words(case: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(DEBUG, raising=False)
    error, code, words = LAST_WORDS[case]
    assert last_words(error) == code
    assert capsys.readouterr().err == f"tlpsim: {words}\n"


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tlpsim with a bug."""

    def build(folder: Path, *, bundle: bool) -> list[Path]:
        raise IndexError("list index\nout of range")

    monkeypatch.setattr("tlpsim.fmus.build.build", build)


def test_a_bug_is_one_line(broken: None, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(DEBUG, raising=False)
    code, told, error = command("build", "-o", "fmus")
    assert (code, told) == (70, "")
    assert error.startswith("tlpsim: bug: IndexError: list index out of range (test_endings.py:")
    assert error.endswith("run it again with TLPSIM_DEBUG=1 for the traceback, and report it\n")
    assert error.count("\n") == 1


def test_debugging_shows_the_traceback(broken: None, command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DEBUG, "1")
    code, _, error = command("build", "-o", "fmus")
    assert code == 70
    assert error.startswith("Traceback (most recent call last):\n")
    assert error.splitlines()[-1].startswith("tlpsim: bug: IndexError")


def test_exit_codes_of_the_documents() -> None:
    """Each in the table, and none that is not there."""
    text = (ROOT / "docs" / "command-line.md").read_text()
    rows = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    assert [int(row) for row in rows if row.isdigit()] == [code.value for code in ExitCode]


def test_usage_errors_and_commands_that_do_not_exist(command: Command) -> None:
    for arguments in (("rum",), ("info",), ("info", "a", "--jason"), ("run", "a.toml", "-o", "r.h5", "--seed", "one")):
        code, told, error = command(*arguments)
        assert (code, told) == (2, "")
        assert "Error" in error


@pytest.mark.parametrize("name", ["info", "resume", "statistics", "check"])
def test_a_folder_is_no_file(name: str, command: Command) -> None:
    code, _, error = command(name, ".")
    assert code == 2
    assert error.startswith("tlpsim: error: ")


def test_version(command: Command) -> None:
    assert command("--version") == (0, f"tlpsim {importlib.metadata.version('tlpsim')}\n", "")


# Quiet commands


@pytest.mark.parametrize("place", ["before", "after", "short"])
def test_a_quiet_command_says_nothing(place: str, command: Command, chain: Path) -> None:
    words = {"before": ("--quiet", "info"), "after": ("info", "--quiet"), "short": ("-q", "info")}[place]
    assert command(*words, chain) == (0, "", "")
    code, told, _ = command("info", chain)  # and is not heard of afterwards
    assert code == 0
    assert "y[1]" in told


def test_a_quiet_command_has_exit_codes_errors_and_json(command: Command, chain: Path, tmp_path: Path) -> None:
    scenario = tmp_path / "s.toml"
    scenario.write_text("")
    assert command("swap", scenario, "wave", chain, "-q") == (1, "", "")
    code, told, error = command("-q", "info", tmp_path / "none.h5")
    assert (code, told) == (2, "")
    assert error.startswith("tlpsim: error: ")
    code, told, error = command("-q", "info", chain, "--json")
    assert told.startswith("{")
    assert error == ""


def test_a_quiet_run_shows_warnings_of_fmus(command: Command, chain: Path, tmp_path: Path) -> None:
    run = ("run", f"a={chain}", "--set", "a.fault=8", "--step", "1", "--stop", "9", "-o", tmp_path / "r.h5")
    code, told, error = command("-q", *run)
    assert (code, told) == (0, "")
    assert error == "tlpsim: a: t = 0 s, warning: the result is rough\n"
    code, told, error = command(*run)
    assert "results: " in told


# Readers that go away


@pytest.mark.parametrize("options", [[], ["--json"]])
def test_a_reader_may_leave(options: list[str], chain: Path) -> None:
    """The reader of standard output is gone before the first line."""
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run([*TLPSIM, "info", str(chain), *options], stdout=write, stderr=subprocess.PIPE, text=True)
    finally:
        os.close(write)
    assert done.stderr == ""
    assert done.returncode == 141


def test_a_run_goes_on_without_a_reader_of_its_progress(chain: Path, tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    output = tmp_path / "r.h5"
    run = ["run", f"a={chain}", "--set", "a.fault=8", "--step", "1", "--stop", "9", "-o", str(output), "--json"]
    try:
        done = subprocess.run([*TLPSIM, *run], stdout=subprocess.PIPE, stderr=write, text=True)
    finally:
        os.close(write)
    assert done.returncode == 0
    assert done.stdout.startswith("{")
    assert open_results(output).complete


# Signals

NAMES = {signal.SIGINT: ("interrupted", 130), signal.SIGTERM: ("terminated", 143)}
REASONS = {signal.SIGINT: "interrupted by Ctrl-C", signal.SIGTERM: "terminated by SIGTERM"}


def has_samples(part: Path) -> bool:
    """Whether a reader finds samples of every component in the file of a run that goes on."""
    with suppress(ResultsError):
        results = open_results(part)
        return all(len(results.time(component)) > 1 for component in results.components)
    return False


def stopped(
    arguments: list[str], number: int, listening: Callable[[], None], ready: Callable[[], bool]
) -> tuple[int, str]:
    """Exit code and errors of a run that gets a signal when it is ready for it."""
    running = subprocess.Popen(
        [*TLPSIM, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, preexec_fn=listening
    )
    deadline = monotonic() + 120.0
    while not ready() and monotonic() < deadline and running.poll() is None:
        sleep(0.05)
    running.send_signal(number)
    _, told = running.communicate(timeout=60)
    return running.returncode, told


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        ("FMUs", signal.SIGINT),
        ("FMUs", signal.SIGTERM),
        ("monolithic", signal.SIGINT),
        ("resumed", signal.SIGTERM),
    ],
)
def test_a_signal_keeps_the_samples_so_far(
    kind: str,
    number: int,
    scenario_file: Path,
    chain: Path,
    tmp_path: Path,
    command: Command,
    listening: Callable[[], None],
) -> None:
    output = tmp_path / "r.h5"
    part = Path(f"{output}.part")
    word, code = NAMES[number]
    if kind == "monolithic":
        arguments = ["run", str(scenario_file), "--duration", "1e7", "-o", str(output), "--monolithic"]
    else:
        arguments = ["run", f"a={chain}", "--step", "1e-3", "--stop", "1e6", "-o", str(output)]
    more = ""
    if kind == "resumed":
        more = f"; go on with: tlpsim resume {output}"
        checkpoint = Path(f"{output}.checkpoint")
        stopped([*arguments, "--checkpoint-every", "100"], number, listening, checkpoint.exists)
        part.unlink()
        arguments = ["resume", str(output)]
    found, told = stopped(arguments, number, listening, lambda: has_samples(part))
    assert told == f"tlpsim: {word}; the samples so far are in {part}; open it with: tlpsim info {part}{more}\n"
    assert found == code
    assert not output.exists()
    results = open_results(part)
    assert results.status == f"failed: {REASONS[number]}"
    assert has_samples(part)
    code, shown, error = command("info", part)
    assert (code, error) == (0, "")
    assert results.status in shown
    assert "mean" in shown  # a table of statistics of what is there


def test_a_signal_before_the_run_leaves_nothing(
    scenario_file: Path, tmp_path: Path, listening: Callable[[], None]
) -> None:
    """The first thing that a run does is to import its parts, which takes longer than this."""
    older = tmp_path / "r.h5.part"
    older.write_text("of another run")
    program = (
        "import os, signal, sys\n"
        "from tlpsim.scenarios.cli import main, run\n"
        "load = run.load\n"
        "def interrupted(*arguments):\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    return load(*arguments)\n"
        "run.load = interrupted\n"
        "main.main()\n"
    )
    arguments = ["run", str(scenario_file), "-o", str(tmp_path / "r.h5")]
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, preexec_fn=listening, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (143, "", "tlpsim: terminated\n")
    assert older.read_text() == "of another run"


def test_commands_without_results_are_interrupted_too(
    scenario_file: Path, command: Command, monkeypatch: pytest.MonkeyPatch, hears_ctrl_c: None
) -> None:
    def interrupt(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("tlpsim.scenarios.cli.system.load", interrupt)
    for arguments in (("check", scenario_file), ("swap", scenario_file, "wave", "a.fmu")):
        assert command(*arguments) == (130, "", "tlpsim: interrupted\n")


def test_the_help_needs_nothing_heavy() -> None:
    """What takes time to import is imported by the commands that need it."""
    program = "import sys, tlpsim.scenarios.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    heavy = {"numpy", "h5py", "numba", "scipy", "pydantic", "matplotlib", "fmpy", "xarray"}
    assert not heavy & {name.partition(".")[0] for name in done.stdout.split()}
