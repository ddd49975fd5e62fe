"""What the documents say exists: their links, their commands, the files that they name."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tlpsim.scenarios.cli.main import app

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
LINK = re.compile(r"\[[^\]]+\]\(([^)#\s]+)(?:#[^)]*)?\)")
SCRIPT = re.compile(r"\b((?:benchmarks|scenarios|docs|tests)/[\w/.-]+\.(?:py|toml|md))\b")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_and_named_files_exist(document: Path) -> None:
    text = document.read_text()
    targets = [t for t in LINK.findall(text) if "://" not in t]
    missing = [t for t in targets if not (document.parent / t).exists()]
    missing += [f for f in SCRIPT.findall(text) if not (ROOT / f).exists()]
    assert not missing


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_commands_in_code_exist(document: Path) -> None:
    known = {command.name or command.callback.__name__ for command in app.registered_commands}  # type: ignore[union-attr]
    code = re.findall(r"```(?:sh|console|bash)\n(.*?)```|`(tlpsim [^`]+)`", document.read_text(), re.DOTALL)
    named = {match.group(1) for block in code for match in re.finditer(r"(?:^|\s)tlpsim ([a-z]+)", "\n".join(block))}
    assert named <= known


COMMANDS = sorted({command.name or command.callback.__name__ for command in app.registered_commands})  # type: ignore[union-attr]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str) -> None:
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    assert len(result.output.splitlines()) > 5
