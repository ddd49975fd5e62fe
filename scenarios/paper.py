"""Table I of the paper: Li and Kareem (1990), Stochastic Response of Tension Leg Platforms to Wind and Wave Fields.

Response of a "typical TLP" to wind, waves and current, by the time and by the frequency domain.
"""

from __future__ import annotations

from collections.abc import Mapping

SOURCE = "Li and Kareem (1990), Table I"
CAVEAT = (
    "the paper's inputs are not published; those of this scenario were inferred by fitting (see the head of the file)"
)
"""What must stand beside every comparison with the table."""
TABLE_I: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "surge": {"mean": (7.55, 7.66), "low_frequency": (1.04, 1.18), "wave_frequency": (0.70, 0.75)},
    "sway": {"mean": (5.81, 5.81), "low_frequency": (0.57, 0.62), "wave_frequency": (0.31, 0.32)},
    "heave": {"mean": (-9.23, -8.75), "low_frequency": (2.25, 2.45), "wave_frequency": (1.77, 1.81)},
    "roll": {"mean": (1.43, 1.06), "low_frequency": (0.87, 1.01), "wave_frequency": (1.26, 1.30)},
    "pitch": {"mean": (6.55, 6.22), "low_frequency": (1.01, 1.11), "wave_frequency": (1.63, 1.77)},
    "yaw": {"mean": (2.94, 2.80), "low_frequency": (0.47, 0.48), "wave_frequency": (0.35, 0.34)},
}
"""Time and frequency domain by degree of freedom and statistic, in `statistics.summary.TABLE_UNITS`."""
