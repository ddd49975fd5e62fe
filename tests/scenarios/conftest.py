"""A short scenario and where its built FMUs are kept."""

from pathlib import Path

import pytest

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
