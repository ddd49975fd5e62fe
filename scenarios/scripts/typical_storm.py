"""Three records of the default storm, the frequency domain beside them, and a report of all.

The records differ in the seed alone, so that their statistics are taken together.
"""

from __future__ import annotations

from tlpsim.scenarios.report.writing import write_report
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments
from tlpsim.scenarios.statistics.signals import run_statistics


def main(argv: list[str] | None = None) -> None:
    """Run, print spreads by both domains, and write the report."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "typical_tlp.toml", given.settings)
    files = [given.folder / f"storm_{seed}.h5" for seed in (1, 2, 3)]
    results = [scenario.with_(simulation={"seed": seed}).run(file) for seed, file in enumerate(files, start=1)]
    expected = scenario.spectral().quantities
    for found in run_statistics(results, ["platform.position.surge", "platform.position.sway"]):
        spread, analysed = found.std, expected[found.name.removeprefix("platform.")].spread()
        print(f"{found.name}: {spread.value:.3f} ({spread.low:.3f} to {spread.high:.3f}), analysed {analysed:.3f} m")
    report = given.folder / "typical_storm.html"
    write_report(files, report)
    print(f"report: {report}")


if __name__ == "__main__":
    main()
