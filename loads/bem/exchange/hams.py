"""Results of HAMS in its WAMIT-like files, read; conventions in `tlpsim.loads.bem.exchange.conventions`.

    Input/ControlFile.in                depth, what the first column is, reference point of the body
    Output/Wamit_format/Buoy.1, .3      as WAMIT's .1 and .3; .4 and .hst where they are there

Versions of HAMS differ in the sign of the phases in Buoy.3; it is told by the longest wave, or given.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.exchange.conventions import CONVENTIONS
from tlpsim.loads.bem.exchange.wamit import read_tables
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError

# Output_frequency_type -> what stands in the first column; the other types are wave numbers and a wave length.
_COLUMNS = {3: "omega", 4: "period"}


def read_hams(
    folder: str | Path,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
    *,
    time_sign: int = 0,
    mass: float = 0.0,
    centre_of_gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> HydrodynamicDatabase:
    """Database of a project folder of HAMS.

    Parameters
    ----------
    folder
        The one that holds `Input` and `Output`.
    density, gravity
        Of the run, kg/m³ and m/s².
    time_sign
        Sign of i omega t that the phases in Buoy.3 belong to, +1 or -1; 0 to be told by the longest wave.
    mass, centre_of_gravity
        Of the body in Hydrostatic.in, kg and (3,) m from the origin, as in `read_wamit`.

    Raises
    ------
    ScenarioError
        If a file is missing or is not of the form above.
    """
    project = Path(folder)
    path = project / "Input" / "ControlFile.in"
    try:
        words = {line.split()[0].lower(): line.split()[1:] for line in path.read_text().splitlines() if line.split()}
        depth = _number(words["waterdepth"][0])
        kind = int(words["output_frequency_type"][0])
        centre = np.array([_number(word) for word in words["reference_body_center"][:3]])
    except (OSError, UnicodeDecodeError, KeyError, IndexError, ValueError) as error:
        raise ScenarioError(f"{path}: not a control file of HAMS ({error!r}); give the folder of the run") from error
    if kind not in _COLUMNS:
        raise ScenarioError(f"{path}: Output_frequency_type is {kind}; run HAMS with 3 (rad/s) or 4 (period)")
    return read_tables(
        project / "Output" / "Wamit_format" / "Buoy",
        depth if depth > 0.0 else np.inf,
        density,
        gravity,
        replace(CONVENTIONS["HAMS"], time_sign=time_sign),
        1.0,  # HAMS writes A / ρ and X / ρ g whatever the length in its control file
        centre,
        mass,
        centre_of_gravity,
        _COLUMNS[kind],
    )


def _number(word: str) -> float:
    return float(word.upper().replace("D", "E"))
