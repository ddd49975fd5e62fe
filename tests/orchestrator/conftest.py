"""Fixtures that the tests of the master share."""

from collections.abc import Callable
from pathlib import Path

import native_fmu
import pytest


@pytest.fixture(scope="session")
def chain_fmu(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Path]:
    """Function of the FMI version that gives the native test FMU, compiled on first use; see `native_fmu`."""
    if native_fmu.COMPILER is None:
        pytest.skip(native_fmu.NO_COMPILER)
    folder = tmp_path_factory.mktemp("native")
    built: dict[int, Path] = {}

    def chain(version: int) -> Path:
        if version not in built:
            built[version] = native_fmu.build(folder, version)
        return built[version]

    return chain
