"""Runs the blocks of a page as a reader would, in a folder of their own, with records that are shorter.

The folder holds copies of `scenarios/*.toml` and of the files that a reader brings along, such as an FMU of a vendor
and the results of a storm; scripts of `benchmarks` can be run from it. The blocks of a page share it, and its Python
blocks one namespace.

A line of a `sh` block that begins with `tlpsim` runs in this process, which is quicker than one for each; whatever
else a line is, a shell runs it, with the same `tlpsim` on its path. In both cases `shortened` appends options to the
command, of which the last one holds where an option is given twice: so a command is checked with all that it says, and
takes a second. The copy of `typical_tlp.toml` is of a short record, too. Blocks that are marked long run as they stand.

Where `resume` follows a run with checkpoints in a block, Ctrl-C ends that run at half its time, as the text supposes.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch
from xml.etree import ElementTree

import jsonschema
import numpy as np
from document_blocks import Block
from typer.testing import CliRunner

from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.json_schema import scenario_schema
from tlpsim.scenarios.progress import RunWatcher
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sweep.sections import SweepFile

ROOT = Path(__file__).parents[2]
SHORT_RUN = 100  # s
_OPERATORS = re.compile(r"[|<>;&`$*()]")
_RUN = ["--duration", str(SHORT_RUN), "--set", "outputs.statistics_from=20"]
_COMPARED = ["--records", "2", "--workers", "1", *_RUN]
_SWEEP = {"scatter", "grid", "cases", "latin_hypercube"}  # sections that only the file of a sweep has
_MESH = ["--omega", "0.3:0.9:4", "--panel", "14"]


def shortened(arguments: Sequence[str]) -> list[str]:
    """Arguments of `tlpsim` with options behind them that make the same command quick."""
    given = list(arguments)
    command = next((each for each in given if not each.startswith("-")), "")
    scenario = any(each.endswith(".toml") for each in given)
    if command == "run":
        given += _RUN if scenario else [] if "--stop" in given else ["--stop", str(SHORT_RUN)]
        given += ["--checkpoint-every", "20"] if "--checkpoint-every" in given else []
    elif command == "compare":
        given += _COMPARED
    elif command == "sensitivity":
        given += ["--workers", "1"] if "--parameters" in given else ["--workers", "1", "--parameters", "wind.speed"]
    elif command == "sweep":
        given += ["--workers", "1"]
    elif command == "bem":
        given += [*_MESH, *(("--qtf-omega", "0.5,0.6") if "--qtf" in given else ())]
    return given


class Page:
    """Runs blocks of one page, in `folder`."""

    def __init__(self, folder: Path, reader_files: Mapping[str, Path]) -> None:
        self.folder = folder
        self.namespace: dict[str, Any] = {"__name__": "__main__"}
        for whole in (True, False):
            _copy_scenarios(folder / ".scenarios" / str(whole), whole)
        (folder / "benchmarks").symlink_to(ROOT / "benchmarks")
        for name, source in reader_files.items():
            shutil.copy(source, folder / name)
        tools = folder / ".bin"
        tools.mkdir()
        (tools / "tlpsim").write_text(f"#!{sys.executable}\n{_TOOL.format(here=str(Path(__file__).parent))}")
        (tools / "tlpsim").chmod(0o755)
        self.path = os.pathsep.join((str(tools), str(Path(sys.executable).parent), os.environ["PATH"]))

    def run(self, block: Block) -> None:
        """Run or read a block; it must be of a page that is run in this folder."""
        scenarios = self.folder / "scenarios"
        scenarios.unlink(missing_ok=True)
        scenarios.symlink_to(self.folder / ".scenarios" / str(block.mark == "long"))
        if block.file:
            (self.folder / block.file).write_text(block.text, encoding="utf-8")
        if block.language == "sh":
            self._shell(block)
        elif block.language == "python" and not block.file:
            exec(compile("\n" * block.line + block.text, str(block.page), "exec"), self.namespace)
        elif block.language == "toml":
            check_toml(block.text)
        elif block.language == "json":
            json.loads(block.text)
        elif block.language == "xml":
            ElementTree.fromstring(f'<page xmlns:ssc="ssc" xmlns:tlpsim="tlpsim">{block.text}</page>')

    def _shell(self, block: Block) -> None:
        short = block.mark != "long"
        resumed = {words[1] for words in map(_words, block.text.splitlines()) if words[:1] == ["resume"]}
        for line in statements(block.text):
            words = shlex.split(line, comments=True)
            if words[:1] == ["tlpsim"] and not needs_shell(line):
                stopped = short and "--checkpoint-every" in words and bool(resumed & set(words))
                with interrupted_halfway(stopped) as code:
                    self._tlpsim(block, line, shortened(words[1:]) if short else words[1:], code)
            else:
                self._other(block, line, short)

    def _tlpsim(self, block: Block, line: str, arguments: list[str], code: int) -> None:
        done = CliRunner().invoke(app, arguments)
        if done.exit_code != code:
            told = f"{block}: {line}\nexit code {done.exit_code}\n{done.output}{done.exception or ''}"
            raise AssertionError(told) from done.exception

    def _other(self, block: Block, line: str, short: bool) -> None:
        environment = os.environ | {"PATH": self.path, "AS_IT_STANDS": "" if short else "1"}
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", line],
            env=environment, cwd=self.folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise AssertionError(f"{block}: {line}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")


_TOOL = """import os, sys
sys.path.insert(0, {here!r})
from document_runner import shortened
from tlpsim.scenarios.cli.main import main
if not os.environ["AS_IT_STANDS"]:
    sys.argv[1:] = shortened(sys.argv[1:])
main()
"""


def needs_shell(line: str) -> bool:
    """Whether a command has more than words: a pipe, a redirection, a pattern of files, a variable."""
    unquoted = re.sub(r"'[^']*'|\"[^\"]*\"", "", line)
    return bool(_OPERATORS.search(re.sub(r"(?:^|\s)#.*", "", unquoted)))


def statements(text: str) -> Iterator[str]:
    """Lines of a shell block, each with those that it goes on in; a block with a here-document or a loop is one."""
    if re.search(r"<<|^(?:for|while|if|cd|export)\b", text, re.MULTILINE):
        yield text
        return
    for line in text.replace("\\\n", " ").splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            yield from line.split(" && ")


def _words(line: str) -> list[str]:
    words = shlex.split(line, comments=True)
    return words[1:] if words[:1] == ["tlpsim"] else []


@contextmanager
def interrupted_halfway(wanted: bool) -> Iterator[int]:
    """Ctrl-C at half the time of a run that is shortened, where that is wanted; gives the exit code to expect."""
    sampled = RunWatcher.sampled

    def pressed(watcher: RunWatcher, index: int, times: np.ndarray, values: np.ndarray) -> None:
        if times[-1] > 0.5 * SHORT_RUN * 1e9:
            signal.raise_signal(signal.SIGINT)
        sampled(watcher, index, times, values)

    if not wanted:
        yield 0
        return
    with patch.object(RunWatcher, "sampled", pressed):
        yield 130


def check_toml(text: str) -> None:
    """A scenario, or a part of one, must be one that the program and its JSON Schema accept; a sweep likewise."""
    data = tomllib.loads(text)
    if _SWEEP & set(data):
        SweepFile.read(data, "a page")
    elif "hull" not in data:
        Scenario.from_dict(data)
        jsonschema.validate(data, scenario_schema())


def _copy_scenarios(folder: Path, whole: bool) -> None:
    """Copy the scenarios, with their own durations or, for Python, which takes no options, with short ones."""
    folder.mkdir(parents=True)
    shutil.copytree(ROOT / "scenarios" / "sweeps", folder / "sweeps")
    for path in [*(ROOT / "scenarios").glob("*.toml"), *(ROOT / "scenarios").glob("*.json")]:
        text = path.read_text(encoding="utf-8")
        if not whole:
            text = text.replace("duration = 3600.0 ", f"duration = {SHORT_RUN}.0 ")
            text = text.replace("statistics_from = 600.0 ", "statistics_from = 20.0 ")
        (folder / path.name).write_text(text, encoding="utf-8")
