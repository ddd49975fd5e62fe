"""Build the project's FMUs: pythonfmu packs the script, this module makes the archive reproducible.

Each build runs in a process of its own, because pythonfmu imports the script and a process keeps the class
it imported first. The same sources always give the same bytes, so an FMU's hash identifies its content.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

from tlpsim.fmus.version import BUILD_RECORD, tlpsim_version
from tlpsim.loads.errors import FmuError

ROOMS = Path(__file__).parent
# file stem of the FMU -> script of its component
COMPONENTS = {
    "wind": ROOMS / "wind_fmu.py",
    "wave": ROOMS / "wave_fmu.py",
    "platform": ROOMS / "platform_fmu.py",
}
BUNDLED_PACKAGES = ("loads", "fmus")
OPTIONS = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)

_BUILD_SCRIPT = """
import sys
from pythonfmu.builder import FmuBuilder
script, destination, *project_files = sys.argv[1:]
FmuBuilder.build_FMU(script, dest=destination, project_files=project_files, **{options!r})
"""


def build(destination: Path, names: Iterable[str] = tuple(COMPONENTS), bundle: bool = False) -> list[Path]:
    """Write `wind.fmu`, `wave.fmu` and `platform.fmu` into a folder.

    Parameters
    ----------
    destination
        Folder, made where it is missing.
    names
        Which of the components to build.
    bundle
        Pack the sources of `tlpsim` in, for a tool where it is not installed. The FMU then needs numpy,
        scipy and numba in the Python it runs in.

    Raises
    ------
    FmuError
        When the folder cannot be written or pythonfmu fails; the message holds its last line.
    """
    try:
        destination.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FmuError(f"cannot make folder {destination}: {error.strerror}; name another with -o") from error
    return [_build_one(name, destination, bundle) for name in names]


def _build_one(name: str, destination: Path, bundle: bool) -> Path:
    with tempfile.TemporaryDirectory(prefix="tlpsim_build_") as folder:
        work = Path(folder)
        record = work / BUILD_RECORD
        record.write_text(json.dumps({"version": tlpsim_version(), "bundled": bundle}))
        project_files = [record]
        if bundle:
            project_files.append(_bundle(work))
        raw = work / f"{name}.fmu"
        script = _BUILD_SCRIPT.format(options=OPTIONS)
        command = [sys.executable, "-c", script, str(COMPONENTS[name]), str(raw), *map(str, project_files)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=work)
        if done.returncode != 0 or not raw.is_file():
            lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
            raise FmuError(f"building {name}.fmu failed: {lines[-1]}")
        finished = work / f"{name}.finished"
        _rewrite(raw, finished)
        target = destination / f"{name}.fmu"
        # os.replace needs one file system: bring the finished file beside its target first.
        beside = destination / f".{name}.fmu.{os.getpid()}"
        shutil.copyfile(finished, beside)
        os.replace(beside, target)
        return target


def _bundle(work: Path) -> Path:
    """Copy the packages that an FMU imports to `tlpsim/` in `work`."""
    bundle = work / "tlpsim"
    for package in BUNDLED_PACKAGES:
        shutil.copytree(ROOMS.parent / package, bundle / package, ignore=shutil.ignore_patterns("__pycache__", "*.nb?"))
    return bundle


def _rewrite(source: Path, target: Path) -> None:
    """Copy an archive with sorted, compressed entries and one fixed date."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for name in sorted(old.namelist()):
            new.writestr(zipfile.ZipInfo(name, _ZIP_EPOCH), old.read(name), compress_type=zipfile.ZIP_DEFLATED)


def built_in(name: str, cache: Path) -> Path:
    """Path of a built-in FMU in a cache folder, built there on first use.

    The folder's name is a hash of the sources, the version and the Python that they were built with.

    Raises
    ------
    FmuError
        When there is no built-in component of that name, or the build fails.
    """
    if name not in COMPONENTS:
        raise FmuError(f"there is no built-in FMU {name!r}: use one of {', '.join(COMPONENTS)}")
    digest = hashlib.sha256(f"{tlpsim_version()} {sys.version}".encode())
    for path in sorted(ROOMS.glob("*.py")):
        digest.update(path.read_bytes())
    folder = cache / digest.hexdigest()[:16]
    path = folder / f"{name}.fmu"
    if not path.is_file():
        build(folder, [name])
    return path
