"""Figures into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tlpsim.loads.errors import ScenarioError


def save(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Write figures as PNG by their file names into a folder, which is made where it is missing; return the files.

    Raises
    ------
    ScenarioError
        When the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, figure in figures.items():
            FigureCanvasAgg(figure).print_png(str(folder / name))
    except OSError as error:
        raise ScenarioError(f"cannot write figures to {folder}: {error.strerror}; name another folder") from error
    return [folder / name for name in figures]
