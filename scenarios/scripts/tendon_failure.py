"""Tethers lost in a storm: what the others of the corner take, at once and in the mean.

The same storm without events, of the same seeds, is the measure.
"""

from __future__ import annotations

import numpy as np

from tlpsim.scenarios.report.writing import write_report
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments

AT_ONCE = 60.0  # s after the loss
CORNER = ("tendon_tension[1]", "tendon_tension[2]", "tendon_tension[3]")


def main(argv: list[str] | None = None) -> None:
    """Run with and without the events, and print tensions of the corner after each."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "tendon_failure.toml", given.settings)
    damaged = scenario.run(given.folder / "damaged.h5")
    intact = scenario.with_(events=[]).run(given.folder / "intact.h5")
    time = damaged.time("platform")
    times = [event.at for event in scenario.events if event.at < time[-1]]
    for begin, end in zip(times, [*times[1:], time[-1]], strict=True):
        part = (time > begin + AT_ONCE) & (time <= end)
        if not part.any():
            print(f"after {begin:g} s: the next event or the end comes within {AT_ONCE:g} s")
            continue
        print(f"after {begin:g} s, MN: intact mean, mean, largest in {AT_ONCE:g} s")
        at_once = (time > begin) & (time <= begin + AT_ONCE)
        for name in CORNER:
            one, other = (each.signal(f"platform.{name}") / 1e6 for each in (damaged, intact))
            print(f"  {name}: {np.mean(other[part]):.2f}, {np.mean(one[part]):.2f}, {np.max(one[at_once]):.2f}")
    report = given.folder / "tendon_failure.html"
    write_report([damaged.path], report)
    print(f"report: {report}")


if __name__ == "__main__":
    main()
