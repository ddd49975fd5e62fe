"""Standard output in a pipe and in a width that is given, and what is heard of a quiet command."""

import os
import subprocess
import sys

import pytest

from tlpsim.scenarios.terminal import complain, hush, messages, output, say, unhush

TABLE = """
from rich.table import Table
from tlpsim.scenarios.terminal import output
table = Table()
table.add_column("name", overflow="fold")
table.add_row("word " * 40)
output.print(table)
"""


def printed(**settings: str) -> list[str]:
    """Lines of a table with a cell of 200 characters in a pipe."""
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR")}
    command = [sys.executable, "-c", TABLE]
    done = subprocess.run(command, env={**environment, **settings}, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_a_row_is_one_line_in_a_pipe() -> None:
    assert sum("word" in line for line in printed()) == 1


def test_a_width_that_is_given_holds_in_a_pipe_too() -> None:
    lines = printed(COLUMNS="60")
    assert sum("word" in line for line in lines) > 1
    assert max(map(len, lines)) <= 60


def test_lines_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    text = "tendon_tension[1] [red] :warning: " * 10
    say(text)
    say(text, aside=True)
    told = capsys.readouterr()
    assert told.out == told.err == f"{text}\n"


def test_warnings_are_heard_of_a_quiet_command(capsys: pytest.CaptureFixture[str]) -> None:
    hush()
    try:
        say("note")
        say("note", aside=True)
        output.print("table")
        messages.print("progress")
        complain("tlpsim: warning: rough")
    finally:
        unhush()
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "tlpsim: warning: rough\n")
