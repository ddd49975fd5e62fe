"""Files that are there when they are complete."""

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
