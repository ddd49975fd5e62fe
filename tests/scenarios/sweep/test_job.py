"""What a worker does, against the functions that it calls; and how it tells what went wrong."""

import json
import pickle
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.spectral.extremes import vanmarcke_bandwidth
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios import run, spectral
from tlpsim.scenarios.results import open_results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral import spectral_response
from tlpsim.scenarios.spectral_file import read_head, read_spectral
from tlpsim.scenarios.spectral_tables import quantity_statistics
from tlpsim.scenarios.statistics.signals import run_statistics
from tlpsim.scenarios.sweep.identity import program_version
from tlpsim.scenarios.sweep.job import TOKEN, Order, Outcome, Place, VersionError, perform, stored
from tlpsim.scenarios.sweep.sections import Statistics

DOMAINS = ("frequency", "time")
FILE = "cases/ab/abc.h5"


@pytest.fixture
def order(quick: Scenario, tmp_path: Path) -> Order:
    """Frequency domain of the quick scenario, that leaves no file."""
    return Order(
        key="abc",
        domain="frequency",
        scenario=quick.to_json(),
        statistics=Statistics(),
        engine="monolithic",
        file="",
        place=Place(folder=str(tmp_path / "sweep"), token="token"),
        version=program_version(),
    )


@pytest.fixture(scope="module")
def response(quick: Scenario) -> SpectralResponse:
    return spectral_response(quick)


@pytest.fixture
def solved(response: SpectralResponse, monkeypatch: pytest.MonkeyPatch) -> None:
    """The frequency domain is known already."""
    monkeypatch.setattr(spectral, "spectral_response", lambda scenario: response)


def numbers(outcome: Outcome) -> dict[str, float]:
    assert outcome.error == ""
    assert len(outcome.names) == len(outcome.units) == len(outcome.values) == len(set(outcome.names))
    return dict(zip(outcome.names, outcome.values.tolist(), strict=True))


def test_frequency_domain(order: Order, response: SpectralResponse) -> None:
    outcome = perform(order)
    found = numbers(outcome)
    for name, quantity in response.quantities.items():
        if not name.startswith(("position.", "tendon_tension[")):
            assert not any(f".{name}." in each for each in found)
            continue
        wanted = quantity_statistics(quantity, 10800.0)
        told = {each.rpartition(".")[2]: found[each] for each in found if each.startswith(f"platform.{name}.")}
        damage = {"damage_equivalent_range": quantity.damage_equivalent_range(4.0)} if quantity.unit == "N" else {}
        assert told == damage | {
            "mean": wanted.mean,
            "low_frequency": wanted.low_frequency,
            "wave_frequency": wanted.wave_frequency,
            "std": wanted.std,
            "skewness": quantity.skewness,
            "excess_kurtosis": quantity.excess_kurtosis,
            "zero_crossing_period": wanted.period,
            "bandwidth": vanmarcke_bandwidth(quantity.frequency, quantity.density),
            "expected_maximum": wanted.maximum,
            "expected_minimum": wanted.minimum,
        }
    units = dict(zip(outcome.names, outcome.units, strict=True))
    assert units["platform.position.roll.std"] == "rad"
    assert units["platform.tendon_tension[1].std"] == "N"
    assert (outcome.key, outcome.file, outcome.content, outcome.notes) == ("abc", "", None, "")
    assert outcome.seconds > 0.0


@pytest.mark.usefixtures("solved")
def test_statistics_are_those_that_are_asked_for(order: Order, response: SpectralResponse) -> None:
    asked = Statistics(signals=("platform.position.[sh]*e",), exposure=600.0, slope=3.0)
    assert "no quantity that matches" in perform(replace(order, statistics=asked)).error  # [ is no set of characters
    asked = asked.model_copy(update={"signals": ("platform.position.s*e",)})
    found = numbers(perform(replace(order, statistics=asked)))
    surge = response.quantities["position.surge"]
    assert {name.rpartition(".")[0] for name in found} == {"platform.position.surge"}
    assert found["platform.position.surge.expected_maximum"] == quantity_statistics(surge, 600.0).maximum
    assert found["platform.position.surge.damage_equivalent_range"] == surge.damage_equivalent_range(3.0)


def test_time_domain(order: Order, quick: Scenario, tmp_path: Path) -> None:
    scenario = quick.with_(waves={"seed": 7})
    asked = Statistics(exposure=1800.0, slope=3.0)
    found = numbers(perform(replace(order, domain="time", scenario=scenario.to_json(), statistics=asked)))
    with threadpool_limits(1):  # as a worker has, since another number of them changes the last bits
        results = run_scenario(scenario, tmp_path / "direct.h5", monolithic=True)
        signals = run_statistics([results], exposure=1800.0, slope=3.0)
    assert len(signals) == 6 + sum(name.startswith("tendon_tension[") for name in results.signals("platform"))
    expected: list[str] = []  # signals with enough maxima for an expected one
    for signal in signals:
        wanted: dict[str, Any] = {
            "mean": signal.mean.value,
            "mean.low": signal.mean.low,
            "mean.high": signal.mean.high,
            "std": signal.std.value,
            "maximum": signal.maximum,
            "minimum": signal.minimum,
            "expected_maximum": signal.expected_maximum.value,
            "expected_minimum.low": signal.expected_minimum.low,
        }
        for side, fit in (("maxima", signal.weibull_maxima), ("minima", signal.weibull_minima)):
            if fit is not None:
                expected.append(signal.name)
                wanted |= {f"weibull_{side}.location": fit.location, f"weibull_{side}.rate": fit.rate}
        if signal.unit == "N":
            assert signal.damage_equivalent_range is not None
            wanted["damage_equivalent_range"] = signal.damage_equivalent_range.value
        for statistic, value in wanted.items():
            np.testing.assert_equal(found[f"{signal.name}.{statistic}"], float(value))
    assert expected
    assert all(np.isfinite(found[f"{name}.expected_maximum"]) for name in expected)
    assert not any(name.endswith((".start", ".records")) for name in found)
    # Of the record itself.
    surge = results.signal("platform.position.surge")
    assert found["platform.position.surge.maximum"] == pytest.approx(float(np.max(surge)))


def test_engines_are_two(order: Order, quick: Scenario) -> None:
    short = quick.with_(simulation={"duration": 20.0}).to_json()
    asked = Statistics(signals=("platform.position.surge",))
    timed = replace(order, domain="time", scenario=short, statistics=asked)
    one, other = (numbers(perform(replace(timed, engine=engine))) for engine in ("monolithic", "cosimulation"))
    name = "platform.position.surge.std"
    assert one[name] != other[name]  # the coupling errs a little
    assert one[name] == pytest.approx(other[name], rel=0.2)


# Files


@pytest.mark.usefixtures("solved")
def test_a_shared_folder_gets_the_file(order: Order, quick: Scenario, tmp_path: Path) -> None:
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / TOKEN).write_text("token")
    outcome = perform(replace(order, file=FILE))
    assert outcome.content is None
    assert outcome.file == FILE
    written = tmp_path / "sweep" / FILE
    assert json.loads(read_head(written)["scenario"])["title"] == "Quick"
    surge = read_spectral(written).quantities["position.surge"]
    assert surge.mean == pytest.approx(numbers(outcome)["platform.position.surge.mean"])
    assert [path.name for path in written.parent.iterdir()] == ["abc.h5"]
    stored(tmp_path / "sweep", outcome)


@pytest.mark.usefixtures("solved")
@pytest.mark.parametrize("token", ["of another sweep", None])
def test_a_folder_that_is_not_shared_gets_the_content(token: str | None, order: Order, tmp_path: Path) -> None:
    (tmp_path / "sweep").mkdir()
    if token is not None:
        (tmp_path / "sweep" / TOKEN).write_text(token)
    outcome = pickle.loads(pickle.dumps(perform(replace(order, file=FILE))))
    assert outcome.content is not None
    assert not (tmp_path / "sweep" / "cases").exists()
    stored(tmp_path / "home", outcome)
    assert (tmp_path / "home" / FILE).read_bytes() == outcome.content
    assert len(read_spectral(tmp_path / "home" / FILE).quantities) > 6


def test_a_record_is_a_results_file(order: Order, quick: Scenario, tmp_path: Path) -> None:
    short = quick.with_(simulation={"duration": 20.0}).to_json()
    stored(tmp_path, perform(replace(order, domain="time", scenario=short, file=FILE)))
    results = open_results(tmp_path / FILE)
    assert results.complete
    assert results.time("platform")[-1] == pytest.approx(20.0)


@pytest.mark.usefixtures("solved")
def test_no_file_is_no_file(order: Order, tmp_path: Path) -> None:
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / TOKEN).write_text("token")
    assert perform(order).content is None
    assert [path.name for path in (tmp_path / "sweep").iterdir()] == [TOKEN]


def test_content_that_cannot_be_stored(order: Order, tmp_path: Path) -> None:
    (tmp_path / "home").write_text("a file")
    outcome = Outcome(key="a", values=np.zeros(0), file=FILE, content=b"x", seconds=0.0)
    with pytest.raises(ScenarioError, match="results of a case cannot be written"):
        stored(tmp_path / "home", outcome)


# What goes wrong


def test_another_version_is_refused(order: Order) -> None:
    with pytest.raises(VersionError, match=r"the sweep was started by 9\.9: install the same version on both"):
        perform(replace(order, version="9.9"))


def raising(error: Exception) -> Callable[..., Any]:
    def fail(*arguments: object, **named: object) -> None:
        raise error

    return fail


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (SolverError("it\n does not   converge"), "it does not converge"),
        (ScenarioError("not allowed"), "not allowed"),
        (MemoryError("much"), "MemoryError: much"),
        (OSError(28, "No space left on device"), "OSError: [Errno 28] No space left on device"),
        (ZeroDivisionError("division by zero"), "bug: ZeroDivisionError: division by zero (test_job.py:"),
    ],
)
@pytest.mark.parametrize("domain", DOMAINS)
def test_an_error_is_a_part_of_the_outcome(
    error: Exception, told: str, domain: str, order: Order, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spectral, "spectral_response", raising(error))
    monkeypatch.setattr(run, "run_scenario", raising(error))
    outcome = perform(replace(order, domain=domain, file=FILE))
    assert outcome.error.startswith(told)
    assert "\n" not in outcome.error
    assert (outcome.key, outcome.names, outcome.units, outcome.file, outcome.content) == ("abc", (), (), "", None)
    assert len(outcome.values) == 0
    pickle.loads(pickle.dumps(outcome))


def test_errors_of_the_case_itself(order: Order, quick: Scenario) -> None:
    missing = quick.with_(components={"table": {"fmu": "/none/table.csv", "step": 1.0}})
    assert "/none/table.csv" in perform(replace(order, domain="time", scenario=missing.to_json())).error
    assert "scenario" in perform(replace(order, scenario="{")).error
    asked = Statistics(signals=("platform.position.nowhere",))
    assert "platform.position.nowhere" in perform(replace(order, domain="time", statistics=asked)).error


def test_warnings_are_notes(order: Order, response: SpectralResponse, monkeypatch: pytest.MonkeyPatch) -> None:
    def warned(scenario: Scenario) -> SpectralResponse:
        for text in ("far\n from good", "worse", "far from good"):
            warnings.warn(text, UserWarning, stacklevel=1)
        warnings.warn("not for users", DeprecationWarning, stacklevel=1)
        return response

    monkeypatch.setattr(spectral, "spectral_response", warned)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert perform(order).notes == "far from good\nworse"


def test_warnings_of_a_failed_job_are_kept(order: Order, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(scenario: Scenario) -> None:
        warnings.warn("this was coming", UserWarning, stacklevel=1)
        raise SolverError("gone")

    monkeypatch.setattr(spectral, "spectral_response", fail)
    outcome = perform(order)
    assert (outcome.error, outcome.notes) == ("gone", "this was coming")
