"""Which version of tlpsim an FMU was built with, and that it runs with no other.

Imports nothing of ours but the errors: an FMU asks it before anything that may have changed since it was built.
"""

from __future__ import annotations

import importlib.metadata
import json
from pathlib import Path

from tlpsim.loads.errors import FmuError

BUILD_RECORD = "tlpsim.json"
"""File among an FMU's resources: `version` it was built with, and whether it has the sources `bundled`."""


def tlpsim_version() -> str:
    """Version of the installed tlpsim, or "unknown" where its sources are bundled with an FMU."""
    try:
        return importlib.metadata.version("tlpsim")
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def built_version(resources: Path) -> str:
    """Version that the FMU in `resources` was built with.

    Raises
    ------
    FmuError
        When the tlpsim that would run it is another version.
    """
    record = resources / BUILD_RECORD
    installed = tlpsim_version()
    if not record.is_file():
        return installed
    built = json.loads(record.read_text())
    if built["bundled"] or built["version"] == installed:
        return str(built["version"])
    raise FmuError(
        f"the FMU was built with tlpsim {built['version']}, but tlpsim {installed} is installed: "
        f"build it again with `tlpsim build`, or install tlpsim=={built['version']}"
    )
