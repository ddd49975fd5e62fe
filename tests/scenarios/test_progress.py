"""Progress where there is no terminal: when a line comes and what it says; and bars in one."""

import os
import re
import subprocess
import sys

import pytest

from tlpsim.scenarios.progress import INTERVAL, LONGEST_SILENCE, Lines, case_bar, spoken


class Clock:
    """Wall time of a test."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("tlpsim.scenarios.progress.monotonic", made)
    return made


def shown(clock: Clock, capsys: pytest.CaptureFixture[str], seconds: float, samples: int = 1000) -> list[str]:
    """Lines of something that takes some seconds at an even speed."""
    lines = Lines()
    for k in range(samples + 1):
        clock.now = 100.0 + seconds * k / samples
        lines.show(float(k), float(samples), f"{k} of {samples} cases")
    return capsys.readouterr().err.splitlines()


def test_what_takes_some_seconds_says_nothing(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(clock, capsys, 0.99 * INTERVAL) == []


def test_half_a_minute_has_a_line_every_ten_seconds(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(clock, capsys, 40.0) == [
        "tlpsim: 250 of 1000 cases, 30 s left",
        "tlpsim: 500 of 1000 cases, 20 s left",
        "tlpsim: 750 of 1000 cases, 10 s left",
    ]


def test_an_hour_has_a_line_every_tenth(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    told = shown(clock, capsys, 3600.0)
    assert told[0] == "tlpsim: 3 of 1000 cases, 60 min left"
    assert [int(line.split()[1]) for line in told[1:]] == [3 + 100 * k for k in range(1, 10)]
    assert told[-1] == "tlpsim: 903 of 1000 cases, 6 min left"


def test_no_silence_is_endless(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    told = shown(clock, capsys, 100.0 * LONGEST_SILENCE, samples=10_000)
    assert len(told) == pytest.approx(100, abs=1)


def test_a_speed_that_is_not_known_gives_no_time_left(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    lines = Lines()
    lines.show(0.0, 5.0, "0 of 5 records")
    clock.now += INTERVAL
    lines.show(0.0, 5.0, "0 of 5 records")
    assert capsys.readouterr().err == "tlpsim: 0 of 5 records\n"


def test_cases_are_counted(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with case_bar("records") as tell:
        tell(0, 24)
        clock.now += 12.0
        tell(6, 24)
    assert capsys.readouterr().err == "tlpsim: 6 of 24 records, 36 s left\n"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.4, "0 s"),
        (99.0, "99 s"),
        (100.0, "2 min"),
        (5900.0, "98 min"),
        (6000.0, "1 h 40 min"),
        (90000.0, "25 h 0 min"),
    ],
)
def test_times_are_spoken(seconds: float, text: str) -> None:
    assert spoken(seconds) == text


BAR = """
from tlpsim.scenarios.progress import case_bar
with case_bar("records") as tell:
    tell(3, 24)
"""


@pytest.mark.parametrize(
    ("settings", "bar", "coloured"),
    [
        ({"FORCE_COLOR": "1", "TERM": "xterm"}, True, True),
        ({"FORCE_COLOR": "1", "TERM": "xterm", "NO_COLOR": "1"}, True, False),
        ({"FORCE_COLOR": "1", "TERM": "dumb"}, False, False),
        ({"TERM": "xterm"}, False, False),
    ],
)
def test_a_terminal_has_a_bar(settings: dict[str, str], bar: bool, coloured: bool) -> None:
    """Of 40 columns, in which it keeps to one line."""
    clean = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "NO_COLOR", "TERM")}
    environment = {**clean, **settings, "COLUMNS": "40"}
    done = subprocess.run([sys.executable, "-c", BAR], env=environment, capture_output=True, check=True)
    assert done.stdout == b""
    told = done.stderr.decode()
    assert ("3 of 24 records" in told) is bar
    assert bool(re.search(r"\x1b\[(3[0-7]|9[0-7]|38;)", told)) is coloured
    frames = re.split(r"\r|\n", re.sub(r"\x1b\[[?0-9;]*[a-zA-Z]", "", told))
    assert max(map(len, frames)) <= 40
