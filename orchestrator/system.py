"""Components, connections, and what can be said of a system before anything runs: errors, notes, loops."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import CAUSAL, SYMMETRIC
from tlpsim.orchestrator.arrays import expanded
from tlpsim.orchestrator.clock import LARGEST_STEP, to_seconds
from tlpsim.orchestrator.events import Event, check_event
from tlpsim.orchestrator.graph import algebraic_loops, strong_components
from tlpsim.orchestrator.instance import Instance, Variable, nearest_match
from tlpsim.orchestrator.units import unit_conversion

INPUTS_AT = ("end", "middle", "start")
"""Where in its step a component's inputs are evaluated."""

ANTI_ALIAS = "anti_alias"
"""The filter for a target that is slower than the source."""

EXTRAPOLATIONS = ("derivatives", "hold", "linear", "quadratic")
"""How a signal is continued beyond its newest sample."""

_MEMBER = re.compile(r"(?<=\[)\d+(?=\])|(?<=\.)[^.\[\]]+$")
"""The number of an element, or the last part of a structured name: what the members of a family differ in."""
_MOST_NAMED = 3
_TAKEN_BY = {
    "Real": ("Real", "Integer", "Boolean"),
    "Integer": ("Integer", "Boolean"),
    "Boolean": ("Boolean",),
}
"""Types of outputs that an input of each type takes."""
_NO_PARAMETERS: Mapping[str, object] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Component:
    """An instance in a system, with a step size of its own.

    Parameters
    ----------
    instance
        What is stepped; its name is the component's name.
    step
        Step in ns.
    parameters
        Parameters, and start values of inputs, by variable name; of an array a list, or lists of lists.
    inputs_at
        Instant within a step for which the inputs are evaluated: ``end``, ``middle`` or ``start``.
    outputs
        Outputs that observers get, in this order; None for all Real outputs. Connected outputs that are not
        among them come after them.
    """

    instance: Instance
    step: int
    parameters: Mapping[str, object] = field(default_factory=lambda: _NO_PARAMETERS)
    inputs_at: str = "end"
    outputs: tuple[str, ...] | None = None

    @property
    def name(self) -> str:
        """Name of the component."""
        return self.instance.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Connection:
    """A signal from an output of one component to an input of another, input = factor * output + offset.

    Parameters
    ----------
    source, source_variable
        Component and output that the signal comes from; the name of an array for all of its elements.
    target, target_variable
        Component and input that it goes to, an array of the same shape for an array.
    filter
        How values between samples are found: ``hold``, ``linear``, ``cubic`` or ``quintic``, and outside
        loops also ``six_point``, ``kaiser`` or ``optimal``, which have no causal form.
    extrapolation
        How values beyond the newest sample are found, which only happens in loops: ``hold``, ``linear`` or
        ``quadratic`` through the newest samples, or ``derivatives``: the derivatives up to second order
        that the source declares, and linear where it declares none.
    factor, offset
        Linear transformation, in the unit of the input: it comes after the conversion of units.
    suppress_unit_conversion
        Take the numbers as they are, whatever the units at the two ends.
    """

    source: str
    source_variable: str
    target: str
    target_variable: str
    filter: str = "cubic"
    extrapolation: str = "derivatives"
    factor: float = 1.0
    offset: float = 0.0
    suppress_unit_conversion: bool = False

    def __str__(self) -> str:
        return f"{self.source}.{self.source_variable} -> {self.target}.{self.target_variable}"


ALGORITHMS = ("multirate", "sequential", "parallel", "iterative", "adaptive")
"""How the components of a loop are stepped, see `tlpsim.orchestrator.loop.algorithms`."""

ACCELERATIONS = ("none", "aitken", "quasi_newton")
"""Of the iteration, see `tlpsim.orchestrator.loop.algorithms`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Iteration:
    """When the iteration of a loop ends, and how it is accelerated.

    Parameters
    ----------
    tolerance
        Largest change of an input between two iterations, relative to its size.
    most
        Number of iterations after which it counts as failed.
    acceleration
        ``quasi_newton``, ``aitken`` or ``none``.
    """

    tolerance: float = 1e-9
    most: int = 50
    acceleration: str = "quasi_newton"


@dataclass(frozen=True, slots=True, kw_only=True)
class Adaptation:
    """How many steps at a time a loop takes.

    Parameters
    ----------
    tolerance
        Largest difference between what an input was taken to be at the end of some steps and what it then was,
        relative to the largest size that it had.
    longest
        Largest number of steps.
    """

    tolerance: float = 1e-4
    longest: int = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class System:
    """Components and their connections.

    Parameters
    ----------
    components, connections
        Names of components are unique.
    algorithm
        Of the loops, one of `ALGORITHMS`.
    iteration
        Of the algorithm ``iterative``.
    adaptation
        Of the algorithm ``adaptive``.
    threads
        Number of components of a loop that step at the same time, with the algorithm ``parallel``. It pays for native
        FMUs whose steps take long; Python FMUs take turns in any case.
    events
        Values that change at given times, see `tlpsim.orchestrator.events`; those of one time in their order.
    """

    components: tuple[Component, ...]
    connections: tuple[Connection, ...] = ()
    algorithm: str = "multirate"
    iteration: Iteration = Iteration()
    adaptation: Adaptation = Adaptation()
    threads: int = 1
    events: tuple[Event, ...] = ()


def _component(by_name: Mapping[str, Component], name: str, connection: Connection) -> Component:
    if name not in by_name:
        raise WiringError(f"connection {connection}: no component '{name}'{nearest_match(name, by_name)}")
    return by_name[name]


def _variable(component: Component, name: str, causality: str, where: str) -> Variable:
    """Return a numerical variable of the wanted causality, or raise."""
    variables = component.instance.variables
    if name not in variables:
        alike = [key for key, variable in variables.items() if variable.causality == causality]
        near = nearest_match(name, alike) or nearest_match(name, variables)
        raise WiringError(f"{where}: component '{component.name}' has no variable '{name}'{near}")
    variable = variables[name]
    if variable.causality != causality:
        raise WiringError(
            f"{where}: '{component.name}.{name}' has the causality {variable.causality}, not {causality}; "
            "connect an output to an input"
        )
    if variable.type not in _TAKEN_BY:
        raise WiringError(
            f"{where}: '{component.name}.{name}' is of the type {variable.type}; "
            f"only {', '.join(_TAKEN_BY)} can be connected"
        )
    return variable


def _check_component(component: Component) -> None:
    name = component.name
    if not isinstance(component.step, int) or component.step <= 0:
        raise WiringError(f"component '{name}': step {component.step!r} is not a positive whole number of ns")
    if component.step > LARGEST_STEP:
        raise WiringError(
            f"component '{name}': step {to_seconds(component.step):g} s is longer than "
            f"{to_seconds(LARGEST_STEP):.4g} s; give a shorter one"
        )
    if component.inputs_at not in INPUTS_AT:
        raise WiringError(
            f"component '{name}': inputs_at = '{component.inputs_at}' is not one of {', '.join(INPUTS_AT)}"
        )
    for output in component.outputs or ():
        _variable(component, output, "output", f"outputs of component '{name}'")


def _check_connection(connection: Connection, by_name: Mapping[str, Component]) -> None:
    where = f"connection {connection}"
    source = _component(by_name, connection.source, connection)
    target = _component(by_name, connection.target, connection)
    output = _variable(source, connection.source_variable, "output", where)
    into = _variable(target, connection.target_variable, "input", where)
    if output.type not in _TAKEN_BY[into.type]:
        raise WiringError(
            f"{where}: the output is {output.type} and the input {into.type}, which takes "
            f"{' and '.join(_TAKEN_BY[into.type])} only; connect a Real input, or an output of the input's type"
        )
    if not (math.isfinite(connection.factor) and math.isfinite(connection.offset)):
        raise WiringError(
            f"{where}: factor {connection.factor} and offset {connection.offset} are not both finite; give numbers"
        )
    if into.type != "Real" and (connection.factor, connection.offset) != (1.0, 0.0):
        raise WiringError(f"{where}: the input is {into.type}; factor and offset are for Real inputs, leave them out")
    _conversion(connection, source.instance, target.instance)
    if connection.filter == ANTI_ALIAS and source.step >= target.step:
        raise WiringError(
            f"{where}: the filter {ANTI_ALIAS} is for a target that is slower than its source, and '{target.name}' "
            f"steps by {to_seconds(target.step):g} s, '{source.name}' by {to_seconds(source.step):g} s; take cubic"
        )
    if connection.filter not in (*SYMMETRIC, ANTI_ALIAS):
        raise WiringError(f"{where}: filter '{connection.filter}' is not one of {', '.join(SYMMETRIC)}, {ANTI_ALIAS}")
    if connection.extrapolation not in EXTRAPOLATIONS:
        raise WiringError(
            f"{where}: extrapolation '{connection.extrapolation}' is not one of {', '.join(EXTRAPOLATIONS)}"
        )


def _conversion(connection: Connection, source: Instance, target: Instance) -> tuple[float, float]:
    gain, offset = 1.0, 0.0
    if not connection.suppress_unit_conversion:
        one = source.variables[connection.source_variable].unit
        other = target.variables[connection.target_variable].unit
        try:
            gain, offset = unit_conversion(one, other, source.units, target.units)
        except ValueError as error:
            raise WiringError(
                f"connection {connection}: the output is in {one} and the input in {other}: {error}; "
                "connect like quantities, or suppress the conversion of units"
            ) from None
    return connection.factor * gain, connection.factor * offset + connection.offset


def conversion(system: System, connection: Connection) -> tuple[float, float]:
    """Return gain and offset of a connection of scalars: input = gain * output + offset.

    Units come first, then factor and offset of the connection. Without either exactly 1 and 0.

    Raises
    ------
    WiringError
        If the units at the two ends are of different dimensions, or differ and are not defined.
    """
    return conversions(system, [connection])[0]


def conversions(system: System, connections: Sequence[Connection]) -> list[tuple[float, float]]:
    """Return gain and offset of connections of scalars; see `conversion`."""
    instances = {component.name: component.instance for component in system.components}
    return [_conversion(each, instances[each.source], instances[each.target]) for each in connections]


def _check_look_ahead(system: System) -> None:
    """Refuse, inside a loop, filters that need samples from beyond the step."""
    group_of = {system.components[index].name: k for k, group in enumerate(groups(system)) for index in group}
    for connection in system.connections:
        in_loop = group_of[connection.source] == group_of[connection.target]
        if in_loop and connection.filter not in (*CAUSAL, ANTI_ALIAS):
            raise WiringError(
                f"connection {connection}: filter '{connection.filter}' looks ahead, which cannot be done inside the "
                f"loop of '{connection.source}' and '{connection.target}'; choose one of {', '.join(CAUSAL)}"
            )


def _check_algorithm(system: System) -> None:
    rule = system.iteration
    for what, value, names in (
        ("algorithm", system.algorithm, ALGORITHMS),
        ("acceleration", rule.acceleration, ACCELERATIONS),
    ):
        if value not in names:
            raise WiringError(f"{what} '{value}' is not one of {', '.join(names)}")
    bounds = system.adaptation
    if not 0.0 < bounds.tolerance < 1.0 or bounds.longest < 1 or system.threads < 1:
        raise WiringError(
            f"adaptation of steps: tolerance {bounds.tolerance}, {bounds.longest} steps at most, {system.threads} "
            "threads; give a tolerance between 0 and 1, one step or more, and one thread or more"
        )
    if not 0.0 < rule.tolerance < 1.0 or rule.most < 1:
        raise WiringError(
            f"iteration of loops: tolerance {rule.tolerance} and {rule.most} iterations at most; give a tolerance "
            "between 0 and 1, and one iteration or more"
        )


def check(system: System) -> list[str]:
    """Check the wiring of a system.

    Returns
    -------
    Notes on what is allowed but may be an oversight, such as inputs that nothing feeds.

    Raises
    ------
    WiringError
        At the first fault: no components, a name used twice, a step that is not positive, an unknown
        component, variable, filter or extrapolation, a wrong causality, type or shape, units of different
        dimensions at the two ends, an input that is fed twice, a filter inside a loop that has no causal form, or an
        event that sets what cannot change.
    """
    system = expanded(system)
    if not system.components:
        raise WiringError("the system has no components; give at least one")
    _check_algorithm(system)
    by_name: dict[str, Component] = {}
    for component in system.components:
        if component.name in by_name:
            raise WiringError(f"component '{component.name}' exists twice; give each one its own name")
        by_name[component.name] = component
        _check_component(component)
    fed: dict[tuple[str, str], Connection] = {}
    for connection in system.connections:
        _check_connection(connection, by_name)
        end = (connection.target, connection.target_variable)
        if end in fed:
            raise WiringError(f"connection {connection}: the input is already fed by {fed[end]}; remove one")
        fed[end] = connection
    _check_look_ahead(system)
    for event in system.events:
        check_event(event, {name: component.instance for name, component in by_name.items()}, fed)
    changed = {(event.component, name) for event in system.events for name in event.values}
    families: dict[str, list[str]] = {}
    for component in system.components:
        for variable in component.instance.variables.values():
            fed_here = (
                (component.name, variable.name) in fed
                or variable.name in component.parameters
                or (component.name, variable.name) in changed
            )
            if variable.causality == "input" and not fed_here:
                name = f"{component.name}.{variable.name}"
                families.setdefault(_MEMBER.sub("*", name), []).append(name)
    return [note for family, names in families.items() for note in _left_open(family, names)] + _loop_notes(system)


def _loop_notes(system: System) -> list[str]:
    cycles = algebraic_loops(system)
    notes = [
        f"algebraic loop {' -> '.join((*cycle, cycle[0]))}: its start values are iterated"
        for cycle in cycles[:_MOST_NAMED]
    ]
    return notes + ([f"{len(cycles) - _MOST_NAMED} more algebraic loops"] if len(cycles) > _MOST_NAMED else [])


def _left_open(family: str, names: Sequence[str]) -> list[str]:
    if len(names) > _MOST_NAMED:
        return [f"{len(names)} inputs {family} are not connected and keep their start values"]
    return [f"input {name} is not connected and keeps its start value" for name in names]


def groups(system: System) -> list[list[int]]:
    """Return the indices of components that must be stepped together, sources before what they feed.

    A group is either one component outside every loop, or all components of a loop (or of loops that share
    components).
    """
    index = {component.name: number for number, component in enumerate(system.components)}
    successors: list[list[int]] = [[] for _ in system.components]
    for connection in system.connections:
        successors[index[connection.source]].append(index[connection.target])
    return strong_components(successors)[::-1]


def loops(system: System) -> list[set[str]]:
    """Return the names of the components of each loop, including components that feed themselves."""
    own = {connection.source for connection in system.connections if connection.source == connection.target}
    names = [{system.components[index].name for index in group} for group in groups(system)]
    return [group for group in names if len(group) > 1 or group & own]


def declared_derivatives(instance: Instance, name: str) -> tuple[str, ...]:
    """Return the names of a variable's declared time derivatives: none, the first, or first and second."""
    return _derivatives_of(name, _derivatives_by_state(instance))


def _derivatives_by_state(instance: Instance) -> dict[str, str]:
    return {
        variable.derivative_of: variable.name
        for variable in instance.variables.values()
        if variable.derivative_of is not None and variable.type == "Real" and variable.causality in ("output", "local")
    }


def _derivatives_of(name: str, by_state: Mapping[str, str]) -> tuple[str, ...]:
    first = by_state.get(name)
    if first is None:
        return ()
    second = by_state.get(first)
    return (first,) if second is None else (first, second)


def used_derivatives(system: System) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Return, for each connection, the declared derivatives of its signal by which it is interpolated, and continued.

    The filters ``cubic`` and ``quintic`` interpolate with one and two of them, unless the inputs always fall on
    samples; with the extrapolation ``derivatives`` up to two continue the signal beyond its newest sample in a loop.
    """
    by_name = {component.name: component for component in system.components}
    group_of = {system.components[index].name: number for number, group in enumerate(groups(system)) for index in group}
    by_state = {name: _derivatives_by_state(component.instance) for name, component in by_name.items()}
    result = []
    for connection in system.connections:
        source, target = by_name[connection.source], by_name[connection.target]
        found = _derivatives_of(connection.source_variable, by_state[connection.source])
        wanted = {"cubic": 1, "quintic": 2}.get(connection.filter, 0)
        offset = {"end": target.step, "middle": target.step // 2}.get(target.inputs_at, 0)
        on_samples = target.step % source.step == 0 and offset % source.step == 0
        between = found[:wanted] if len(found) >= wanted and not on_samples else ()
        in_loop = group_of[connection.source] == group_of[connection.target]
        result.append((between, found if in_loop and connection.extrapolation == "derivatives" else ()))
    return result


def bound_outputs(system: System) -> list[tuple[str, ...]]:
    """Return, for each component, the outputs that are read after every step, in the order observers get
    them.

    These are the chosen outputs (all Real ones by default), then connected ones, then the declared
    derivatives that are needed to interpolate, or to extrapolate in a loop.
    """
    result: list[tuple[str, ...]] = []
    used = used_derivatives(system)
    outgoing: dict[str, list[int]] = {component.name: [] for component in system.components}
    for k, connection in enumerate(system.connections):
        outgoing[connection.source].append(k)
    for component in system.components:
        names = component.outputs
        if names is None:
            names = tuple(
                variable.name
                for variable in component.instance.variables.values()
                if variable.causality == "output" and variable.type == "Real"
            )
        chosen = dict.fromkeys(names)
        chosen.update(dict.fromkeys(system.connections[k].source_variable for k in outgoing[component.name]))
        for k in outgoing[component.name]:
            chosen.update(dict.fromkeys((*used[k][0], *used[k][1])))
        result.append(tuple(chosen))
    return result
