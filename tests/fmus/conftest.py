"""The project's FMUs, built once for all tests."""

from pathlib import Path

import pytest

from tlpsim.fmus.build import build


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Path of each built FMU by its stem."""
    return {path.stem: path for path in build(tmp_path_factory.mktemp("fmus"))}
