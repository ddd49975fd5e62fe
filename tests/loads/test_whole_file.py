"""Files that are there when they are complete, and outputs that cannot be."""

import os
from pathlib import Path

import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import require_writable, whole_file


def test_a_file_appears_when_it_is_complete(tmp_path: Path) -> None:
    target = tmp_path / "new" / "a.txt"
    with whole_file(target, "the text") as part:
        part.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    assert [path.name for path in target.parent.iterdir()] == ["a.txt"]


def test_nothing_is_left_of_a_file_that_fails(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_file(tmp_path / "a.txt", "the text") as part:
            part.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_outputs_that_can_be_written(tmp_path: Path) -> None:
    """Folders that are missing are made when it comes to it, and a file may be there already."""
    (tmp_path / "a.h5").write_text("older")
    require_writable(None, tmp_path / "a.h5", tmp_path / "not" / "yet" / "b.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_outputs_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    for path, words in ((tmp_path, "is a folder"), (tmp_path / "file" / "a.h5", "is a file, not a folder")):
        with pytest.raises(ScenarioError, match=words):
            require_writable(None, path)
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK)  # of a folder of another user
    with pytest.raises(ScenarioError, match="may not be written"):
        require_writable(tmp_path / "a.h5")
