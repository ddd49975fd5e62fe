"""The report of a coupling and what a run says of it, against closed forms for sinusoids."""

import math

import numpy as np
import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.coupling_report import ConnectionMeasure, ConnectionReport, CouplingMeter, coupling_report
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.system import Component, Connection, System

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND
FREQUENCY = 0.05


def sine(values: Values, time: float) -> None:
    angle = 2 * np.pi * FREQUENCY
    values["x"] = math.sin(angle * time)
    values["v"] = angle * math.cos(angle * time)
    values["a"] = -(angle**2) * math.sin(angle * time)


def system(
    steps: tuple[int, int],
    *,
    in_loop: bool = False,
    filter_name: str = "cubic",
    extrapolation: str = "derivatives",
    declared: bool = False,
    inputs_at: str = "end",
    algorithm: str = "multirate",
) -> System:
    """A sine that goes to a probe, with steps in ms; in a loop the probe goes back to it."""
    origin = PythonInstance(
        "origin",
        lambda values, time, size: sine(values, time + size),
        inputs={"idle": 0.0},
        outputs={"x": 0.0, "v": 0.0, "a": 0.0},
        initialize=sine,
        derivatives={"v": "x", "a": "v"} if declared else {},
    )
    probe = PythonInstance("probe", lambda v, t, h: v.update(y=v["u"]), inputs={"u": 0.0}, outputs={"y": 0.0})
    wires = [
        Connection(
            source="origin",
            source_variable="x",
            target="probe",
            target_variable="u",
            filter=filter_name,
            extrapolation=extrapolation,
        )
    ]
    if in_loop:
        wires.append(Connection(source="probe", source_variable="y", target="origin", target_variable="idle"))
    return System(
        components=(
            Component(instance=origin, step=steps[0] * MILLISECOND),
            Component(instance=probe, step=steps[1] * MILLISECOND, inputs_at=inputs_at),
        ),
        connections=tuple(wires),
        algorithm=algorithm,
    )


def reported(*arguments: object, band: float = 0.1, **options: object) -> ConnectionReport:
    return coupling_report(system(*arguments, **options), band)[0]  # type: ignore[arg-type]


def measured(*arguments: object, **options: object) -> ConnectionMeasure:
    meter = CouplingMeter()
    run(system(*arguments, **options), 400 * SECOND, observers=[meter])  # type: ignore[arg-type]
    return meter.measures()[0]


def test_linear_interpolation() -> None:
    """Its gain is sinc² but for the discrete phases: 1 - (1 + cos w)/2 at half a step, for two phases."""
    found = reported((500, 250), filter_name="linear")
    w = 2 * np.pi * 0.1
    # phases 0 and 1/2: gain (1 + cos(w/2)) / 2, image (1 - cos(w/2)) / 2
    assert found.band == pytest.approx(0.2)
    assert found.error == pytest.approx(0.5 * (1.0 - math.cos(w / 2)), rel=1e-9)
    assert found.image == pytest.approx(20 * math.log10(0.5 * (1.0 - math.cos(w / 2))), rel=1e-9)
    assert found.delay == pytest.approx(0.0, abs=1e-12)
    assert (found.alias, found.extrapolation, found.filter) == (-math.inf, "", "linear, looks ahead")


def test_held_values_are_late_by_half_a_step_less_half_a_substep() -> None:
    found = reported((500, 100), filter_name="hold")
    assert found.delay == pytest.approx(0.2)
    assert reported((500, 250), filter_name="hold").delay == pytest.approx(0.125)


def test_a_slower_target_takes_samples_as_they_are() -> None:
    """What lies at 0.9 to 1.1 Hz folds onto the band of the target of 1 s at its full size."""
    found = reported((100, 1000))
    assert (found.filter, found.error, found.alias) == ("samples as they are", 0.0, 0.0)
    assert found.band == pytest.approx(0.1)
    filtered = reported((100, 1000), filter_name="anti_alias")
    assert filtered.alias < -75.0
    assert filtered.error < 2e-4
    assert reported((100, 100)).alias == -math.inf


@pytest.mark.parametrize(
    ("extrapolation", "declared", "gain"),
    [
        ("hold", False, lambda z, n: 1.0),
        ("linear", False, lambda z, n: 1.0 + n - n / z),
        ("derivatives", True, lambda z, n: 1.0 + n * np.log(z) + 0.5 * (n * np.log(z)) ** 2),
    ],
)
def test_extrapolation_over_a_step_of_the_slower_one(extrapolation: str, declared: bool, gain: object) -> None:
    """A fast source and a slow target in a loop: the target steps first, 5 samples beyond the newest one."""
    found = reported((100, 500), in_loop=True, extrapolation=extrapolation, declared=declared)
    z = np.exp(2j * np.pi * 0.2 * 0.1)  # a sample's turn at the end of the band, 0.1 cycles in 0.5 s
    assert found.horizon == 0.5
    assert found.filter == ""
    assert found.extrapolation_error == pytest.approx(abs(gain(z, 5) - z**5), rel=1e-9)  # type: ignore[operator]
    # 1.8 to 2.2 Hz and 3.8 to 4.2 Hz fold onto the band of 0.2 Hz of the target; the last is continued worst
    highest = abs(gain(np.exp(2j * np.pi * 4.2 * 0.1), 5))  # type: ignore[operator]
    assert declared or found.alias == pytest.approx(20 * math.log10(highest), abs=1e-6)


def test_who_extrapolates_depends_on_the_algorithm() -> None:
    """At equal rates the one declared first extrapolates; with parallel steps both do, with iterated ones none."""
    back, forth = (coupling_report(system((100, 100), in_loop=True))[k] for k in (1, 0))
    assert (back.horizon, back.filter) == (0.1, "")
    assert (forth.horizon, forth.filter) == (0.0, "samples as they are")
    both = coupling_report(system((100, 100), in_loop=True, algorithm="parallel"))
    assert [each.horizon for each in both] == [0.1, 0.1]
    none = coupling_report(system((100, 100), in_loop=True, algorithm="iterative"))
    assert [each.horizon for each in none] == [0.0, 0.0]
    slow = reported((500, 100), in_loop=True, algorithm="parallel")
    assert (slow.filter, slow.horizon) == ("cubic, causal", 0.1)


def test_the_band_is_an_argument() -> None:
    assert reported((100, 100), inputs_at="middle", band=0.25).band == pytest.approx(2.5)
    assert reported((100, 100), inputs_at="middle").filter == "cubic, looks ahead"
    with pytest.raises(WiringError, match=r"the band ends at 0.6 cycles a sample; it must be above 0 and at most 0.5"):
        reported((100, 100), band=0.6)


def test_measured_interpolation_is_the_error_at_twice_the_step() -> None:
    """For samples of a sine, linear: 1 - cos w of each, cubic by derivatives: 1 - cos w - (w/2) sin w."""
    w = 2 * np.pi * FREQUENCY * 0.5
    linear = measured((500, 100), filter_name="linear")
    assert linear.interpolation == pytest.approx(1.0 - math.cos(w), rel=2e-3)
    assert math.isnan(linear.extrapolation)
    assert linear.deviation == pytest.approx(math.sqrt(0.5), rel=1e-3)
    assert linear.samples >= 798
    hermite = measured((500, 100), declared=True)
    assert hermite.interpolation == pytest.approx(1.0 - math.cos(w) - 0.5 * w * math.sin(w), rel=2e-3)
    assert hermite.interpolation == pytest.approx(w**4 / 24, rel=0.02)


@pytest.mark.parametrize(("extrapolation", "declared"), [("hold", False), ("linear", False), ("derivatives", True)])
def test_measured_extrapolation_is_that_of_the_report(extrapolation: str, declared: bool) -> None:
    """The report is for the end of the band: put it at the frequency of the sine, 0.025 cycles in 0.5 s."""
    options = {"in_loop": True, "extrapolation": extrapolation, "declared": declared}
    found = measured((100, 500), **options)
    expected = reported((100, 500), band=FREQUENCY * 0.5, **options).extrapolation_error
    assert found.extrapolation == pytest.approx(expected, rel=5e-3)
    assert math.isnan(found.interpolation)


def test_what_does_not_vary_has_no_relative_error() -> None:
    still = PythonInstance("still", lambda values, time, size: None, outputs={"y": 3.0})
    probe = PythonInstance("probe", lambda values, time, size: None, inputs={"u": 0.0})
    wire = Connection(source="still", source_variable="y", target="probe", target_variable="u")
    meter = CouplingMeter()
    assert meter.measures() == []
    components = (Component(instance=still, step=2 * SECOND), Component(instance=probe, step=SECOND))
    run(System(components=components, connections=(wire,)), 40 * SECOND, observers=[meter])
    assert math.isnan(meter.measures()[0].interpolation)
    assert meter.measures()[0].deviation == 0.0
