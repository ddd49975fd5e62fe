"""Files that are there when they are complete, and whether they can be written at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tlpsim.loads.errors import ScenarioError


@contextmanager
def whole_file(path: str | Path, what: str) -> Iterator[Path]:
    """A name beside `path` to write to; it becomes `path` where the block ends well, and nothing where it does not.

    Folders are made. `what` is the file's content, for the error message.

    Raises
    ------
    ScenarioError
        If the file cannot be written.
    """
    target = Path(path)
    part = target.with_name(f"{target.name}.{os.getpid()}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(target)  # a reader never sees half a file
    except OSError as error:
        raise ScenarioError(f"{path}: {what} cannot be written ({error}); name another file") from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def require_writable(*paths: Path | None) -> None:
    """Tell before a long computation that its results could not be written; None is nowhere.

    Raises
    ------
    ScenarioError
        If a path is a folder, or in one that cannot be made or written.
    """
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise ScenarioError(f"{path} is a folder: give the name of a file in it")
        folder = next(parent for parent in path.resolve().parents if parent.exists())
        if not folder.is_dir():
            raise ScenarioError(f"{folder} is a file, not a folder: give another place for {path.name}")
        if not os.access(folder, os.W_OK):
            raise ScenarioError(f"{folder} may not be written: give another place for {path.name}")
