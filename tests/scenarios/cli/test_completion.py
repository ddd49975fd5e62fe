"""Completion as the shells ask for it; bash itself where it is there."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tlpsim.scenarios.cli import completion
from tlpsim.scenarios.schema import Scenario

BIN = Path(sys.executable).parent
INSTALLED = (BIN / "tlpsim").exists()


def asked(shell: str, **environment: str) -> list[str]:
    """What the command answers to a shell."""
    settings = {**os.environ, "_TLPSIM_COMPLETE": f"complete_{shell}", **environment}
    done = subprocess.run([str(BIN / "tlpsim")], env=settings, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    return done.stdout.splitlines()


def test_keys_are_those_of_a_scenario() -> None:
    """Each key is taken by a scenario with its own default, where it has one."""
    keys = dict(completion.scenario_keys())
    assert len(keys) > 90
    settings = {name: key.default for name, key in keys.items() if key.default and " " not in key.default}
    assert len(settings) > 60
    data = Scenario().model_dump(by_alias=True)
    for name, default in settings.items():
        value = data
        for part in name.split("."):
            value = value[part]
        assert str(value).lower() == default.lower(), name


def test_words_are_those_that_a_scenario_takes() -> None:
    keys = dict(completion.scenario_keys())
    assert keys["waves.drift"].words == ("newman", "newman_geometric", "qtf", "none")
    assert keys["waves.splash"].words == ("true", "false")
    assert keys["components.wave.inputs_at"].words == ("end", "middle", "start")
    for word in keys["wind.spectrum"].words:
        Scenario().with_(**{"wind.spectrum": word})


@pytest.mark.parametrize(
    ("incomplete", "offered"),
    [
        ("waves.sig", ["waves.significant_height=", "waves.significant_height=7.08"]),
        ("waves.generator=h", ["waves.generator=harmonic"]),
        ("waves.generator", ["waves.generator=", "waves.generator=arma", "waves.generator=harmonic"]),
        ("wind.profile", ["wind.profile=", "wind.profile_exponent="]),
        ("wind.profile=", ["wind.profile=", *(f"wind.profile={w}" for w in ("logarithmic", "power", "api", "iso"))]),
        ("waves.hs", []),
    ],
)
def test_settings(incomplete: str, offered: list[str]) -> None:
    assert [text for text, _ in completion.settings(incomplete)] == offered


def test_lists_of_keys_are_completed_at_their_end() -> None:
    assert completion.parameters("wind.speed,waves.peak_p") == ["wind.speed,waves.peak_period"]


COMPLETE = """
eval "$(_TLPSIM_COMPLETE=source_bash tlpsim)"
complete -p tlpsim
ask() {
    COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
    _tlpsim_completion tlpsim
    echo "${COMPREPLY[@]}"
}
ask tlpsim res
ask tlpsim run storm.toml --set waves.sig
ask tlpsim swap storm.toml pl
ask tlpsim figures h
ask tlpsim run storm.toml --qui
"""


@pytest.mark.skipif(not INSTALLED or shutil.which("bash") is None, reason="needs bash and the command itself")
def test_bash_completes() -> None:
    settings = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "--norc", "-c", COMPLETE], env=settings, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.splitlines() == [
        "complete -o default -F _tlpsim_completion tlpsim",
        "resume",
        "waves.significant_height= waves.significant_height=7.08",
        "platform",
        "hydro",
        "--quiet",
    ]


@pytest.mark.skipif(not INSTALLED, reason="needs the command itself")
def test_zsh_and_fish_ask_in_their_own_ways() -> None:
    typed = {"_TYPER_COMPLETE_ARGS": "tlpsim run storm.toml --set waves.sig"}
    assert 'waves.significant_height="' in "".join(asked("zsh", **typed))
    fish = asked("fish", **typed, _TYPER_COMPLETE_FISH_ACTION="get-args")
    assert fish == ["waves.significant_height=\tdefault 7.08", "waves.significant_height=7.08"]
