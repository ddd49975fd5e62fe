"""The storm from all sides: response over the heading of wind, waves and current, by the frequency domain.

Wind, waves and current turn together. One heading is also simulated, so that the two domains can be compared.
"""

from __future__ import annotations

import csv

from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments
from tlpsim.scenarios.statistics.summary import summary

TURNS = range(0, 91, 15)  # degrees; the hull is square, so that the other quarters repeat this one
COLUMNS = ("position.surge", "position.sway", "position.yaw", "tendon_tension[1]", "tendon_tension[7]")
HOURS = 3.0


def turned(scenario: Scenario, angle: float) -> Scenario:
    """The scenario with wind, waves and current turned by an angle in degrees."""
    sections = ("wind", "waves", "current")
    return scenario.with_(**{f"{name}.heading_deg": getattr(scenario, name).heading_deg + angle for name in sections})


def main(argv: list[str] | None = None) -> None:
    """Analyse all headings into a table, and simulate the last one."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "typical_tlp.toml", given.settings)
    table = given.folder / "heading_sweep.csv"
    with table.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["turn, deg", *(f"{name} {what}" for name in COLUMNS for what in ("mean", "std", "maximum"))])
        for angle in TURNS:
            found = turned(scenario, angle).spectral().quantities
            row = [(q.mean, q.spread(), q.extremes(HOURS * 3600.0).maximum) for q in map(found.__getitem__, COLUMNS)]
            rows.writerow([angle, *(f"{value:.6g}" for three in row for value in three)])
            shown = (f"{name} {mean:.4g} ± {std:.2g}" for name, (mean, std, _) in zip(COLUMNS, row, strict=True))
            print(f"{angle:3d} deg: " + ", ".join(shown))
    results = turned(scenario, TURNS[-1]).run(given.folder / "heading_90.h5")
    for motion in summary(results).motions[:2]:
        print(f"simulated at {TURNS[-1]} deg: {motion.name} {motion.mean:.4g} ± {motion.std:.2g} {motion.unit}")
    print(f"table: {table}")


if __name__ == "__main__":
    main()
