"""Wiring faults, notes, loops and bound outputs."""

from dataclasses import replace

import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.instance import PythonInstance, Variable
from tlpsim.orchestrator.system import (
    Component,
    Connection,
    System,
    bound_outputs,
    check,
    groups,
    loops,
    strong_components,
)


def idle(values: object, time: float, size: float) -> None:
    pass


def wind() -> PythonInstance:
    return PythonInstance(
        "wind",
        idle,
        inputs={"velocity.surge": 0.0},
        outputs={"force.surge": 0.0, "force.sway": 0.0},
        units={"force.surge": "N", "force.sway": "N", "velocity.surge": "m/s"},
    )


def platform() -> PythonInstance:
    return PythonInstance(
        "platform",
        idle,
        inputs={"wind_force.surge": 0.0, "wind_force.sway": 0.0},
        outputs={"position.surge": 0.0, "velocity.surge": 0.0, "acceleration.surge": 0.0},
        parameters={"mass": 5.0e7},
        units={"wind_force.surge": "N", "wind_force.sway": "N", "velocity.surge": "m/s"},
        derivatives={"velocity.surge": "position.surge", "acceleration.surge": "velocity.surge"},
    )


FORCE = Connection(source="wind", source_variable="force.surge", target="platform", target_variable="wind_force.surge")
FEEDBACK = Connection(
    source="platform", source_variable="velocity.surge", target="wind", target_variable="velocity.surge"
)


def system(*connections: Connection) -> System:
    return System(
        components=(
            Component(instance=wind(), step=500_000_000),
            Component(instance=platform(), step=100_000_000),
        ),
        connections=connections,
    )


FAULTS = {
    "component": (replace(FORCE, source="wnd"), "no component 'wnd'; nearest match: 'wind'"),
    "source": (
        replace(FORCE, source_variable="forces.surge"),
        "component 'wind' has no variable 'forces.surge'; nearest match: 'force.surge'",
    ),
    "target": (
        replace(FORCE, target_variable="wind_forc.surge"),
        "component 'platform' has no variable 'wind_forc.surge'; nearest match: 'wind_force.surge'",
    ),
    "input as source": (
        replace(FORCE, source_variable="velocity.surge"),
        "'wind.velocity.surge' has the causality input, not output",
    ),
    "parameter as target": (
        replace(FORCE, target_variable="mass"),
        "'platform.mass' has the causality parameter, not input",
    ),
    "unit": (
        replace(FEEDBACK, source="wind", source_variable="force.surge"),
        "the output is in N and the input in m/s",
    ),
    "filter": (
        replace(FORCE, filter="spline"),
        "filter 'spline' is not one of hold, linear, cubic, quintic, six_point, kaiser, optimal",
    ),
    "extrapolation": (
        replace(FORCE, extrapolation="cubic"),
        "extrapolation 'cubic' is not one of derivatives, hold, linear, quadratic",
    ),
}


@pytest.mark.parametrize(("connection", "message"), FAULTS.values(), ids=FAULTS.keys())
def test_wiring_faults(connection: Connection, message: str) -> None:
    with pytest.raises(WiringError) as caught:
        check(system(connection))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["six_point", "kaiser", "optimal"])
def test_filters_without_a_causal_form_are_for_sources(name: str) -> None:
    assert check(system(replace(FORCE, filter=name)))  # a note on what is not connected, no error
    for connections in ((replace(FORCE, filter=name), FEEDBACK), (FORCE, replace(FEEDBACK, filter=name))):
        with pytest.raises(
            WiringError, match=f"'{name}' looks ahead.* choose one of hold, linear, cubic, quintic"
        ) as caught:
            check(system(*connections))
        assert "\n" not in str(caught.value)


def test_input_fed_twice() -> None:
    with pytest.raises(WiringError, match=r"already fed by wind\.force\.surge -> platform\.wind_force\.surge"):
        check(system(FORCE, replace(FORCE, source_variable="force.sway")))


def test_only_real_variables_are_connected() -> None:
    broken = system(FORCE)
    variables = dict(broken.components[0].instance.variables)
    variables["force.surge"] = Variable(name="force.surge", causality="output", type="Integer")
    broken.components[0].instance.variables = variables
    with pytest.raises(WiringError, match="is of the type Integer; only Real"):
        check(broken)


def test_spelling_of_units_and_dimensionless_units() -> None:
    spelled = system(FORCE)
    for component, name, unit in zip(
        spelled.components, ("force.surge", "wind_force.surge"), ("N*m", "N.m"), strict=True
    ):
        variables = dict(component.instance.variables)
        variables[name] = replace(variables[name], unit=unit)
        component.instance.variables = variables
    check(spelled)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"step": 0}, "step 0 is not a positive whole number of ns"),
        ({"step": 0.1}, r"step 0\.1 is not a positive whole number"),
        ({"inputs_at": "begin"}, "inputs_at = 'begin' is not one of end, middle, start"),
        ({"outputs": ("force.heave",)}, r"no variable 'force\.heave'; nearest match: 'force\."),
    ],
)
def test_component_faults(changes: dict[str, object], message: str) -> None:
    component = Component(**{"instance": wind(), "step": 100, **changes})  # type: ignore[arg-type]
    with pytest.raises(WiringError, match=message):
        check(System(components=(component,)))


def test_names_are_unique_and_present() -> None:
    with pytest.raises(WiringError, match="'wind' exists twice"):
        check(System(components=(Component(instance=wind(), step=1), Component(instance=wind(), step=1))))
    with pytest.raises(WiringError, match="no components"):
        check(System(components=()))


def test_notes_name_unconnected_inputs() -> None:
    notes = check(system(FORCE, FEEDBACK))
    assert notes == ["input platform.wind_force.sway is not connected and keeps its start value"]


def test_many_unconnected_inputs_of_one_family_are_one_note() -> None:
    names = [
        *(f"intact[{k}]" for k in range(12)),
        *(f"force.{axis}" for axis in "uvwx"),
        "depth",
        "moment.x",
        "moment.y",
    ]
    hull = PythonInstance("hull", idle, inputs=dict.fromkeys(names, 0.0), outputs={}, units={})
    assert check(System(components=(Component(instance=hull, step=1, parameters={"force.u": 1.0}),))) == [
        "12 inputs hull.intact[*] are not connected and keep their start values",
        "input hull.force.v is not connected and keeps its start value",
        "input hull.force.w is not connected and keeps its start value",
        "input hull.force.x is not connected and keeps its start value",
        "input hull.depth is not connected and keeps its start value",
        "input hull.moment.x is not connected and keeps its start value",
        "input hull.moment.y is not connected and keeps its start value",
    ]


def test_loops() -> None:
    assert loops(system(FORCE)) == []
    assert loops(system(FORCE, FEEDBACK)) == [{"wind", "platform"}]
    itself = replace(FORCE, target="wind", target_variable="velocity.surge")
    assert loops(system(itself)) == [{"wind"}]


def test_groups_come_sources_first() -> None:
    assert groups(system(FORCE)) == [[0], [1]]
    assert groups(system(FEEDBACK)) == [[1], [0]]
    assert groups(system(FORCE, FEEDBACK)) == [[0, 1]]


def test_strong_components_of_a_known_graph() -> None:
    # 0 -> 1 -> 2 -> 0, 2 -> 3, 3 <-> 4, 5 -> 4
    assert strong_components([[1], [2], [0, 3], [4], [3], [4]]) == [[3, 4], [0, 1, 2], [5]]


def test_bound_outputs_are_chosen_then_connected_then_derivatives() -> None:
    names = bound_outputs(system(FORCE, FEEDBACK))
    assert names[0] == ("force.surge", "force.sway")
    assert names[1] == ("position.surge", "velocity.surge", "acceleration.surge")
    both = system(FORCE, FEEDBACK)
    chosen = replace(both, components=tuple(replace(item, outputs=()) for item in both.components))
    # the acceleration continues the velocity in the loop
    assert bound_outputs(chosen) == [("force.surge",), ("velocity.surge", "acceleration.surge")]
