"""The hundred-year storm: offset, air gap and tensions that three hours of it bring, observed and expected.

One record has one largest value; the distribution of its maxima and the frequency domain say what to expect.
"""

from __future__ import annotations

from tlpsim.scenarios.report.writing import write_report
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.scripts.arguments import SCENARIOS, arguments
from tlpsim.scenarios.statistics.signals import run_statistics

SIGNALS = ("position.surge", "airgap", "tendon_tension[1]", "tendon_tension[7]")


def main(argv: list[str] | None = None) -> None:
    """Run, print extremes, and write the report."""
    given = arguments(__doc__, argv)
    scenario = Scenario.load(SCENARIOS / "hundred_year_storm.toml", given.settings)
    results = scenario.run(given.folder / "hundred_year_storm.h5")
    expected = scenario.spectral().quantities
    for found in run_statistics([results], [f"platform.{name}" for name in SIGNALS]):
        name = found.name.removeprefix("platform.")
        low, high = found.expected_minimum, found.expected_maximum
        print(f"{name}, {found.unit}: {found.minimum:.4g} to {found.maximum:.4g}", end="; ")
        print(f"expected in 3 h {low.value:.4g} to {high.value:.4g}", end="")
        if name in expected:
            analysed = expected[name].extremes(3 * 3600.0)
            print(f", analysed {analysed.minimum:.4g} to {analysed.maximum:.4g}", end="")
        print()
    report = given.folder / "hundred_year_storm.html"
    write_report([results.path], report)
    print(f"report: {report}")


if __name__ == "__main__":
    main()
