"""A component swapped: the wind FMU's forces are recorded, and a table of them takes its place.

The table holds the forces on the platform as it moved, so that the same motion comes out again, but for what the
coupling makes of them: a loop is cut. An FMU of a vendor is swapped in alike, see docs/swapping.md.
"""

from __future__ import annotations

import numpy as np

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.orchestrator.table import write_table
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments


def main(argv: list[str] | None = None) -> None:
    """Run, record the wind, run again with the table, and print how far the motions are apart."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "typical_tlp.toml", given.settings)
    own = scenario.run(given.folder / "own_wind.h5")
    table = given.folder / "wind.csv"
    names = [f"force.{degree}" for degree in DEGREES_OF_FREEDOM]
    signals = {name: own.signal(f"wind.{name}") for name in names}
    write_table(table, own.time("wind"), signals, {name: own.unit(f"wind.{name}") for name in names})
    # The mean force of a table is not known before the run, so the place to start from is given.
    start = {
        f"initial_position.{degree}": float(own.signal(f"platform.position.{degree}")[0])
        for degree in DEGREES_OF_FREEDOM
    }
    components = {"wind": {"fmu": str(table.resolve())}, "platform": {"parameters": start}}
    swapped = scenario.with_(components=components)
    recorded = swapped.run(given.folder / "recorded_wind.h5")
    for degree in DEGREES_OF_FREEDOM:
        one, other = (each.signal(f"platform.position.{degree}") for each in (own, recorded))
        apart = np.sqrt(np.mean((one - other) ** 2)) / np.std(one)
        print(f"{degree}: root mean square difference {100.0 * apart:.2f} % of the standard deviation")


if __name__ == "__main__":
    main()
