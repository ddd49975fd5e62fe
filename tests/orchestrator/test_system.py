"""Wiring faults, notes, loops and bound outputs."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.graph import shortest_cycle
from tlpsim.orchestrator.instance import PythonInstance, Unit
from tlpsim.orchestrator.system import (
    Component,
    Connection,
    System,
    algebraic_loops,
    bound_outputs,
    check,
    conversion,
    expanded,
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


# Units and linear transformations


def converted(source_unit: str | None, target_unit: str | None, **changes: object) -> tuple[float, float]:
    units = {"force.surge": source_unit, "wind_force.surge": target_unit}
    made = system(FORCE)
    for component in made.components:
        component.instance.variables = {
            name: replace(variable, unit=units.get(name, variable.unit))
            for name, variable in component.instance.variables.items()
        }
    connection = replace(FORCE, **changes)  # type: ignore[arg-type]
    check(replace(made, connections=(connection,)))
    return conversion(made, connection)


def test_units_of_one_dimension_are_converted() -> None:
    assert converted("N", "N") == (1.0, 0.0)
    assert converted("kN", "N") == (1e3, 0.0)
    assert converted("N", "MN") == (1e-6, 0.0)
    assert converted("deg", "rad") == (math.pi / 180.0, 0.0)
    assert converted("degC", "K") == (1.0, 273.15)
    assert converted(None, "N") == (1.0, 0.0)


def test_the_linear_transformation_comes_after_the_units() -> None:
    assert converted("kN", "N", factor=2.0, offset=5.0) == (2e3, 5.0)
    assert converted("degC", "K", factor=2.0, offset=5.0) == (2.0, 551.3)
    assert converted("kN", "m", factor=2.0, offset=5.0, suppress_unit_conversion=True) == (2.0, 5.0)


def test_units_of_different_dimensions_are_told_with_both() -> None:
    with pytest.raises(WiringError, match=r"output is in N and the input in m: .* dimension kg\.m\.s-2 and m of m; .*"):
        converted("N", "m")


def test_a_components_own_definitions_count() -> None:
    made = system(FORCE)
    source = made.components[0].instance
    source.variables = {**source.variables, "force.surge": replace(source.variables["force.surge"], unit="lbf")}
    with pytest.raises(WiringError, match="what lbf is, is not defined"):
        check(made)
    source.units = {"lbf": Unit(exponents=(1, 1, -2, 0, 0, 0, 0, 0), factor=4.4482216152605)}
    check(made)
    assert conversion(made, FORCE) == (4.4482216152605, 0.0)


@pytest.mark.parametrize("changes", [{"factor": math.nan}, {"offset": math.inf}])
def test_factor_and_offset_are_finite(changes: dict[str, float]) -> None:
    with pytest.raises(WiringError, match="are not both finite"):
        converted("N", "N", **changes)


# Types


def typed(source_type: str, target_type: str, **changes: object) -> System:
    made = system(replace(FORCE, **changes))  # type: ignore[arg-type]
    for component, name, kind in zip(
        made.components, ("force.surge", "wind_force.surge"), (source_type, target_type), strict=True
    ):
        variables = component.instance.variables
        component.instance.variables = {**variables, name: replace(variables[name], type=kind, unit=None)}
    return made


@pytest.mark.parametrize(
    ("source_type", "target_type"),
    [("Integer", "Real"), ("Boolean", "Real"), ("Boolean", "Integer"), ("Integer", "Integer"), ("Boolean", "Boolean")],
)
def test_a_narrower_type_goes_into_a_wider_one_and_is_held(source_type: str, target_type: str) -> None:
    made = typed(source_type, target_type)
    check(made)
    assert [(item.filter, item.extrapolation) for item in expanded(made).connections] == [("hold", "hold")]


@pytest.mark.parametrize(
    ("source_type", "target_type"), [("Real", "Integer"), ("Real", "Boolean"), ("Integer", "Boolean")]
)
def test_a_wider_type_is_refused(source_type: str, target_type: str) -> None:
    with pytest.raises(WiringError, match=f"the output is {source_type} and the input {target_type}, which takes"):
        check(typed(source_type, target_type))


def test_text_is_not_connected_and_whole_numbers_are_not_scaled() -> None:
    with pytest.raises(WiringError, match="of the type String; only Real, Integer, Boolean can be connected"):
        check(typed("String", "Real"))
    with pytest.raises(WiringError, match="factor and offset are for Real inputs"):
        check(typed("Integer", "Integer", factor=2.0))


# Arrays


def array_system(rows: int = 2, value: object = ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))) -> System:
    elements = [f"[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]
    a = PythonInstance("a", idle, outputs={f"x{each}": 0.0 for each in elements})
    b = PythonInstance(
        "b", idle, inputs={f"u{each}": 0.0 for each in elements}, parameters={f"k{each}": 0.0 for each in elements}
    )
    a.arrays = {"x": (2, 3)}
    b.arrays = {"u": (rows, 3), "k": (2, 3)}
    return System(
        components=(
            Component(instance=a, step=1, outputs=("x",)),
            Component(instance=b, step=1, parameters={"k": value}),
        ),
        connections=(Connection(source="a", source_variable="x", target="b", target_variable="u", factor=2.0),),
    )


def test_arrays_are_connected_element_by_element() -> None:
    made = expanded(array_system())
    ends = [(item.source_variable, item.target_variable, item.factor) for item in made.connections]
    assert ends == [(f"x[{i},{j}]", f"u[{i},{j}]", 2.0) for i in (1, 2) for j in (1, 2, 3)]
    assert made.components[0].outputs == tuple(f"x[{i},{j}]" for i in (1, 2) for j in (1, 2, 3))
    assert made.components[1].parameters["k[2,1]"] == 4.0
    assert check(array_system()) == []
    assert expanded(made) == made


@pytest.mark.parametrize("value", [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], np.arange(1.0, 7.0).reshape(2, 3)])
def test_values_of_arrays_may_be_flat_or_numpy(value: object) -> None:
    assert list(expanded(array_system(value=value)).components[1].parameters.values()) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_other_shapes_are_refused() -> None:
    with pytest.raises(WiringError, match=r"output is an array of shape \(2, 3\) and the input an array of .*3, 3"):
        check(array_system(rows=3))
    with pytest.raises(WiringError, match=r"'b': 'k' is given with the shape \(2,\); its shape is \(2, 3\)"):
        check(array_system(value=[1.0, 2.0]))
    with pytest.raises(WiringError, match="rows of unequal length"):
        check(array_system(value=[[1.0, 2.0], [3.0]]))
    made = array_system()
    scalar = replace(made.connections[0], target_variable="u[1,1]")
    with pytest.raises(WiringError, match=r"output is an array of shape \(2, 3\) and the input a scalar"):
        check(replace(made, connections=(scalar,)))


# Algebraic loops


def direct(name: str, depends_on: tuple[str, ...] | None) -> PythonInstance:
    made = PythonInstance(name, idle, inputs={"u": 0.0, "v": 0.0}, outputs={"y": 0.0})
    made.variables = {**made.variables, "y": replace(made.variables["y"], depends_on=depends_on)}
    return made


def ring(*dependencies: tuple[str, ...] | None) -> System:
    names = [f"c{number}" for number in range(len(dependencies))]
    return System(
        components=tuple(
            Component(instance=direct(name, each), step=1) for name, each in zip(names, dependencies, strict=True)
        ),
        connections=tuple(
            Connection(source=name, source_variable="y", target=names[(k + 1) % len(names)], target_variable="u")
            for k, name in enumerate(names)
        ),
    )


def test_algebraic_loops_are_named() -> None:
    assert algebraic_loops(ring(None, ("u", "v"))) == [("c0.y", "c1.u", "c1.y", "c0.u")]
    assert algebraic_loops(ring(None)) == [("c0.y", "c0.u")]
    notes = check(ring(None, None))
    assert "algebraic loop c0.y -> c1.u -> c1.y -> c0.u -> c0.y: its start values are iterated" in notes


def test_what_does_not_depend_directly_breaks_a_loop() -> None:
    assert algebraic_loops(ring(None, ("v",))) == []
    assert algebraic_loops(ring((), None)) == []
    # without `initialize` the outputs of a component of functions are their start values
    assert algebraic_loops(system(FORCE, FEEDBACK)) == []


def test_a_long_ring_is_found_without_recursion() -> None:
    cycles = algebraic_loops(ring(*[None] * 3000))
    assert [len(cycle) for cycle in cycles] == [6000]


def test_the_shortest_cycle_is_named() -> None:
    assert shortest_cycle([[1, 2], [0], [3], [0]], [0, 1, 2, 3]) == [0, 1]
    assert shortest_cycle([[1], []], [0]) == []
