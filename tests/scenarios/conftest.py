"""A short scenario, and a native FMU."""

import importlib.util
from pathlib import Path

import pytest

MASTER_TESTS = Path(__file__).parents[1] / "orchestrator"

SHORT = """
title = "Short"
[simulation]
duration = 20.0
[waves]
components = 20
"""


@pytest.fixture
def scenario_file(tmp_path: Path) -> Path:
    """Scenario of 20 s."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The native test FMU of the master's tests: y' = k u - y, u in N, y in m."""
    spec = importlib.util.spec_from_file_location("chain_fmu", MASTER_TESTS / "native_fmu.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if module.COMPILER is None:
        pytest.skip(module.NO_COMPILER)
    return Path(module.build(tmp_path_factory.mktemp("chain"), 2))
