"""Free decay in calm water: natural periods and damping of surge and yaw, from the crests of the motion.

The damping of the drag grows with the motion, so each pair of crests has its own. For the amplitude a_k of the crest k
the logarithmic decrement is

    delta_k = ln(a_k / a_{k+1}),    ratio of critical damping = delta_k / sqrt(4 pi^2 + delta_k^2)     (1)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments

LEAST_SHARE = 0.02  # of the first amplitude, below which a crest says nothing


def crests(
    time: NDArray[np.float64], motion: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Periods (s), amplitudes of the first of each two crests, and ratios of damping between them, eq. (1)."""
    places = np.array([0, *find_peaks(motion, height=LEAST_SHARE * motion[0])[0]])
    amplitude = motion[places]
    decrement = np.log(amplitude[:-1] / amplitude[1:])
    return np.diff(time[places]), amplitude[:-1], decrement / np.sqrt(4.0 * np.pi**2 + decrement**2)


def main(argv: list[str] | None = None) -> None:
    """Run, and print what the crests say."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "free_decay.toml", given.settings)
    results = scenario.run(given.folder / "free_decay.h5")
    time = results.time("platform")
    for degree, unit in (("surge", "m"), ("yaw", "rad")):
        for period, amplitude, ratio in zip(*crests(time, results.signal(f"platform.position.{degree}")), strict=True):
            print(f"{degree}: {period:.1f} s, damping {100.0 * ratio:.1f} % from {amplitude:.3g} {unit} on")


if __name__ == "__main__":
    main()
