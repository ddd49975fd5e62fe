import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.report.analysis import Analysis
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.document import Cell, Table
from tlpsim.scenarios.report.loads import alone, load_blocks, recorded_loads
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.statistics.summary import TABLE_UNITS

TIME = np.arange(8000) * 0.5


@pytest.fixture
def loaded(written: Callable[..., Results], storm: Scenario) -> Analysis:
    """A slow and a quick harmonic, in kN and in N m, of two records whose amplitudes are 1 and 3."""
    results = []
    for seed, size in ((1, 1.0), (2, 3.0)):
        slow, quick = (size * np.sin(2.0 * np.pi * f * TIME) for f in (0.01, 0.1))
        signals = {"wave.drift.surge": 5.0 + 2.0 * slow, "wave.drift.yaw": 4.0 * quick, "wave.none.heave": 0.0 * quick}
        signals["wave.elevation"] = quick
        units = {"wave.drift.surge": "kN", "wave.drift.yaw": "N.m", "wave.none.heave": "N", "wave.elevation": "m"}
        results.append(written(signals, units, storm.with_(simulation={"seed": seed})))
    (case,) = cases(results)
    return Analysis(case=case, start=0.0, statistics={}, without_statistics="", response=None, without_response="")


def test_recorded_loads_by_band_in_si_units(loaded: Analysis) -> None:
    found = recorded_loads(loaded)
    assert set(found) == {"wave.drift"}  # neither what is zero nor the elevation
    # Average variance of a harmonic of amplitudes a and 3 a: a^2 (1 + 9) / 4. The taper over a tenth costs half of 5 %.
    surge, yaw = 2000.0 * math.sqrt(2.5), 4.0 * math.sqrt(2.5)
    np.testing.assert_allclose(found["wave.drift"][0], [5000.0, surge, 0.0], rtol=0.01, atol=0.02 * surge)
    np.testing.assert_allclose(found["wave.drift"][5], [0.0, 0.0, yaw], rtol=0.01, atol=0.02 * yaw)
    assert np.isnan(found["wave.drift"][1]).all()


def test_response_to_one_excitation_alone(fake_response: Callable[..., SpectralResponse]) -> None:
    response = fake_response()
    found = alone(response)
    whole = found["all together"]
    for k, (degree, (_, scale)) in enumerate(TABLE_UNITS.items()):
        quantity = response.quantities[f"position.{degree}"]
        expected = [scale * quantity.spread(*edges) for edges in ((0.0, 0.022), (0.022, 0.2))]
        np.testing.assert_allclose(whole[:, k], expected)
    # The fake's excitations have shares of the whole spectrum.
    np.testing.assert_allclose(found["wind"], math.sqrt(0.5) * whole)
    np.testing.assert_allclose(found["splash"], math.sqrt(0.02) * whole)


def test_bars_are_relative_to_the_largest_of_the_column(
    loaded: Analysis, fake_response: Callable[..., SpectralResponse]
) -> None:
    blocks = load_blocks([dataclasses.replace(loaded, response=fake_response())])
    tables = [block for block in blocks if isinstance(block, Table)]
    low = next(table for table in tables if table.caption.startswith("Response to one excitation alone"))
    shares = {row.heading: row.cells[0].share for row in low.rows if isinstance(row.cells[0], Cell)}
    assert shares["all together"] == 1.0
    assert shares["wind"] == pytest.approx(math.sqrt(0.5))
