"""Zip archives and XML that would do harm."""

import stat
import zipfile
from pathlib import Path

import pytest

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator import archive
from tlpsim.orchestrator.archive import extract, read_xml


@pytest.mark.parametrize(
    ("member", "message"),
    [
        ("../x", "leads out of the folder"),
        ("a/../../x", "leads out of the folder"),
        ("/x", "has no relative path"),
        ("C:/x", "has no relative path"),
        ("link", "is a link or a device"),
    ],
)
def test_members_that_would_leave_the_folder_are_refused(tmp_path: Path, member: str, message: str) -> None:
    entry = zipfile.ZipInfo(member)
    if member == "link":
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as packed:
        packed.writestr("good", b"good")
        packed.writestr(entry, b"/etc/passwd")
    (tmp_path / "out").mkdir()
    with pytest.raises(FmuError, match=message):
        extract(tmp_path / "x.zip", tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


def test_archives_that_are_too_large_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(tmp_path / "x.zip", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("zeros", bytes(1 << 20))
    with monkeypatch.context() as changed:
        changed.setattr(archive, "HARMLESS_SIZE", 1 << 10)
        with pytest.raises(FmuError, match="more than 500 times"):
            extract(tmp_path / "x.zip", tmp_path)
    with monkeypatch.context() as changed:
        changed.setattr(archive, "LARGEST_SIZE", 1 << 10)
        with pytest.raises(FmuError, match="extracts to 1048576 bytes and may have 1024"):
            extract(tmp_path / "x.zip", tmp_path)
    with monkeypatch.context() as changed:
        changed.setattr(archive, "LARGEST_COUNT", 0)
        with pytest.raises(FmuError, match="1 members"):
            extract(tmp_path / "x.zip", tmp_path)
    extract(tmp_path / "x.zip", tmp_path)
    assert (tmp_path / "zeros").stat().st_size == 1 << 20


def test_entities_are_never_read() -> None:
    bomb = b'<!DOCTYPE a [<!ENTITY b "' + b"x" * 10 + b'">]><a>&b;</a>'
    with pytest.raises(FmuError, match=r"here: the XML has a DOCTYPE, which could hold entities; remove it"):
        read_xml(bomb, "here")
    assert read_xml("<?xml version='1.0' encoding='utf-16'?><a b='ü'/>".encode("utf-16"), "here").get("b") == "ü"
