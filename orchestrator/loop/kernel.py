"""The compiled loop of the master: whose turn it is, its inputs, its step, and its sample.

Of all components in a loop, the one with the earliest time of its own steps next; of several, the one with the largest
step (slow first), then the one declared first. A slow component thus steps over its whole step with feedback inputs
that are extrapolated, and the fast ones then step inside that window on values that are interpolated. Outside loops
nothing is extrapolated: before a component steps, what feeds it is stepped until it has all the samples that the
interpolation filter needs. With the algorithm `PARALLEL` all components of a loop that are due at one time get their
inputs before any of them steps.

Everything is in a few flat arrays, in which a component and a link are rows of whole numbers, named here. A component
whose FMU has no addresses to call is left to the caller: the loop fills its inputs and returns `CALL`, and goes on from
the sample that the caller puts in the component's next row. The loop also returns when samples have to be taken away
(`FULL`), when a weight is missing (`WEIGHTS`), when a component fails (`FAILED`), when a group is due that the caller
steps (`GROUP_DUE`), and after a number of steps (`PAUSE`).

Samples. Sample n of a component belongs to the time start + n step, and lies in row n - base of its history; samples
before the first one equal it. Inputs are, of samples x with their derivatives x^(d) as far as the filter uses them,

    u = gain sum_d sum_k w_dk x_k^(d) + offset                                                        (1)

with weights from tables that the caller fills, one set for every instant within a sample step that occurs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tlpsim.orchestrator.loop.native import call_step, call_values, load, load_integer, nanoseconds, store

# What the loop returns.
DONE, PAUSE, CALL, FULL, WEIGHTS, FAILED, GROUP_DUE = range(7)

# Columns of a component's row.
(
    STEP,  # ns
    OFFSET,  # ns, of the instant of its inputs within a step
    GROUP,
    TIME,  # ns, its own
    START,  # ns, of the first sample
    NEWEST,  # number of the newest sample
    BASE,  # number of the sample in row 0
    ROWS,  # of the history
    KEPT,  # rows that must be kept
    HISTORY,  # place of row 0 in the heap
    WIDTH,  # bound outputs
    TAKEN,  # number of the newest sample that has been taken away
    INPUTS,  # place in the heap
    INPUT_COUNT,
    SIZES,  # place in the heap of the largest size that each input had
    FIRST_LINK,
    LINKS,
    FILLED,  # 1: has its inputs for the next step
    STEPS,
    NANOSECONDS,
    VERSION,  # of FMI; 0: the caller steps it
    INSTANCE,
    SET_VALUES,
    DO_STEP,
    GET_VALUES,
    SET_REFERENCES,  # address, and count
    SET_REFERENCE_COUNT,
    SET_BUFFER,  # address, and number of values; 0: the values lie in the heap in the order of the call
    SET_NUMBER,
    SET_PLACES,  # place in the index of the places in that buffer
    GET_REFERENCES,
    GET_REFERENCE_COUNT,
    GET_BUFFER,
    GET_NUMBER,
    GET_PLACES,
) = range(35)
UNIT_COLUMNS = 35

# Columns of a link's row.
(
    SOURCE,
    INTO,  # place in the heap of its first input
    SIGNALS,
    BEFORE,
    AFTER,
    AHEAD,  # 1: the source is stepped ahead
    ORDER,  # of the polynomial that extrapolates, where no derivatives are declared
    COLUMNS,  # place in the index of the columns of values, derivatives, second derivatives
    INTERPOLATED,  # number of derivatives, values included, that the filter uses
    EXTRAPOLATED,  # the same of the extrapolation; 1: the polynomial
    KEYS,  # place in the index of the keys of the weights
    TABLE,  # place in the heap of the weights
    STRIDE,  # numbers of one set of weights
    SCALES,  # place in the heap of gain and offset of each signal; -1: none
    SMOOTH,  # 1: the filter is for samples too, and extrapolates
) = range(15)
LINK_COLUMNS = 15

# Columns of a group's row.
(
    FIRST_MEMBER,
    END_OF_MEMBERS,
    ALGORITHM,
    TURN,  # component whose turn it is
    PLACE,  # its place in the members
    DUE,  # its time
    READY,  # time for which all that are due have their inputs, of the algorithm PARALLEL
    WINDOW,  # steps that the caller takes at a time
) = range(8)
GROUP_COLUMNS = 8

# Places in the array of what is left to the caller.
UNIT, STATUS, PHASE, LINK, KEY, DEPTH, PENDING, FINAL = range(8)  # FINAL: 1 if no step is ever taken back
CONTROL_SIZE = 8
FLAGS = 16  # place in the room of what a step of FMI 3.0 returns

SEQUENTIAL, PARALLEL, CALLER = range(3)
"""Algorithms of a group: one component after the other, all that are due together, or as the caller does it."""
GROUP_STEPPED = -2
"""What the caller leaves in `control[PENDING]` after `GROUP_DUE`."""
SLOTS = 1024  # sets of weights of a link
_PROBES = 32
UNUSED = np.iinfo(np.int64).min
_TIMED = 16  # steps, a power of two, of which the time of one is measured
SETTING, STEPPING, GETTING, ENDING, EARLY = range(5)  # what failed, of a step
_WARNING = 1


# Without reference counts (`_nrt`), which take longer than the steps of a native FMU: nothing is allocated here. To
# pass all arrays on takes longer than what most of the functions do: they become part of the loop.
_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
_compiled = njit(**_OPTIONS)
_inlined = njit(forceinline=True, **_OPTIONS)


@_inlined
def weights_place(link, key, links, index):  # type: ignore[no-untyped-def]
    """Slot of a set of weights, or minus one less the slot where it has to go."""
    keys = links[link, KEYS]
    first = (key ^ (key >> 17) ^ (key >> 31)) & (SLOTS - 1)
    for probe in range(_PROBES):
        slot = (first + probe) & (SLOTS - 1)
        found = index[keys + slot]
        if found == key:
            return slot
        if found == UNUSED:
            return -1 - slot
    return -1 - first


@_inlined
def fill_link(link, time, units, links, index, heap, control):  # type: ignore[no-untyped-def]
    """Eq. (1) for a time in ns; False where the weights are missing, which `control` then names."""
    source = links[link, SOURCE]
    newest = units[source, NEWEST]
    signals, into, columns = links[link, SIGNALS], links[link, INTO], links[link, COLUMNS]
    history, width = units[source, HISTORY], units[source, WIDTH]
    derivatives, taps = 1, 1
    smooth = links[link, SMOOTH] == 1
    key = units[source, TIME] - time
    first = newest
    if key > 0:
        elapsed = time - units[source, START]
        number = elapsed // units[source, STEP]
        key = elapsed - number * units[source, STEP]
        first = number
        if key == 0 and smooth:
            key = units[source, STEP]
        if key > 0:
            taps = links[link, BEFORE] + links[link, AFTER]
            first = number + 1 - links[link, BEFORE]
            derivatives = links[link, INTERPOLATED]
    elif smooth:
        key = key if key < 0 else units[source, STEP]
        taps = links[link, BEFORE]
        first = newest + 1 - taps
    elif key < 0:
        derivatives = links[link, EXTRAPOLATED]
        if derivatives == 1:
            taps = links[link, ORDER] + 1
        first = newest + 1 - taps
    start = history + (first - units[source, BASE]) * width
    if key == 0:
        for k in range(signals):
            heap[into + k] = heap[start + index[columns + k]]
    else:
        slot = weights_place(link, key, links, index)
        if slot < 0:
            control[LINK], control[KEY] = link, key
            return False
        weights = links[link, TABLE] + slot * links[link, STRIDE]
        for k in range(signals):
            total = 0.0
            for d in range(derivatives):
                column = start + index[columns + d * signals + k]
                for tap in range(taps):
                    total += heap[weights + d * taps + tap] * heap[column + tap * width]
            heap[into + k] = total
    scales = links[link, SCALES]
    if scales >= 0:
        for k in range(signals):
            heap[into + k] = heap[scales + 2 * k] * heap[into + k] + heap[scales + 2 * k + 1]
    return True


@_inlined
def fill_inputs(unit, time, units, links, index, heap, control):  # type: ignore[no-untyped-def]
    """Inputs of a component for a time in ns; False where weights are missing."""
    first = units[unit, FIRST_LINK]
    for link in range(first, first + units[unit, LINKS]):
        if not fill_link(link, time, units, links, index, heap, control):
            return False
    return True


@_inlined
def compact(unit, units, heap):  # type: ignore[no-untyped-def]
    """Move the samples of a component that must be kept to the beginning of its history."""
    row = units[unit, NEWEST] + 1 - units[unit, BASE]
    kept, history, width = units[unit, KEPT], units[unit, HISTORY], units[unit, WIDTH]
    shift = (row - kept) * width
    for k in range(history, history + kept * width):
        heap[k] = heap[k + shift]
    units[unit, BASE] += row - kept


@_compiled
def make_room(units, heap):  # type: ignore[no-untyped-def]
    """Compact the histories of all components, whose samples have been taken away: they then fill up together."""
    for unit in range(units.shape[0]):
        if units[unit, NEWEST] + 1 - units[unit, BASE] > units[unit, KEPT]:
            compact(unit, units, heap)


@_inlined
def next_row(unit, units, heap):  # type: ignore[no-untyped-def]
    """Place in the heap of the row of a component's next sample; -1 where samples have to be taken away first."""
    row = units[unit, NEWEST] + 1 - units[unit, BASE]
    if row >= units[unit, ROWS]:
        if units[unit, TAKEN] < units[unit, NEWEST]:
            return -1
        compact(unit, units, heap)
        row = units[unit, NEWEST] + 1 - units[unit, BASE]
    return units[unit, HISTORY] + row * units[unit, WIDTH]


@_inlined
def _native_step(unit, row, clock, units, index, heap, room, control):  # type: ignore[no-untyped-def]
    """Step of an FMU by its addresses, its sample into a row; False where it fails, which `control` tells."""
    version, instance, places = units[unit, VERSION], units[unit, INSTANCE], units[unit, SET_PLACES]
    timed = units[unit, STEPS] & (_TIMED - 1) == 0
    began = nanoseconds(clock, room) if timed else 0
    control[UNIT] = unit
    count, buffer = units[unit, INPUT_COUNT], units[unit, SET_BUFFER]
    if count > 0:
        if buffer == 0:
            buffer = heap.ctypes.data + 8 * units[unit, INPUTS]
        else:
            for k in range(count):
                store(buffer, index[places + k], heap[units[unit, INPUTS] + k])
        references, number = units[unit, SET_REFERENCES], units[unit, SET_NUMBER]
        status = call_values(
            version, units[unit, SET_VALUES], instance, references, units[unit, SET_REFERENCE_COUNT], buffer, number
        )
        if status > _WARNING:
            control[STATUS], control[PHASE] = status, SETTING
            return False
    time, size = units[unit, TIME] / 1e9, units[unit, STEP] / 1e9
    status = call_step(version, units[unit, DO_STEP], instance, time, size, control[FINAL], room + FLAGS)
    flags = load_integer(room + FLAGS, 0) if version == 3 else 0
    if status > _WARNING or flags & 0xFFFF00:
        phase = STEPPING if status > _WARNING else ENDING if flags & 0xFF00 else EARLY
        control[STATUS], control[PHASE] = status, phase
        return False
    return _native_outputs(unit, row, began, timed, clock, units, index, heap, room, control)


@_inlined
def _native_outputs(unit, row, began, timed, clock, units, index, heap, room, control):  # type: ignore[no-untyped-def]
    width, buffer, places = units[unit, WIDTH], units[unit, GET_BUFFER], units[unit, GET_PLACES]
    if width > 0:
        version, instance, references = units[unit, VERSION], units[unit, INSTANCE], units[unit, GET_REFERENCES]
        count, number = units[unit, GET_REFERENCE_COUNT], units[unit, GET_NUMBER]
        direct = buffer == 0
        if direct:
            buffer = heap.ctypes.data + 8 * row
        status = call_values(version, units[unit, GET_VALUES], instance, references, count, buffer, number)
        if status > _WARNING:
            control[STATUS], control[PHASE] = status, GETTING
            return False
        if not direct:
            for k in range(width):
                heap[row + k] = load(buffer, index[places + k])
    if timed:
        units[unit, NANOSECONDS] += _TIMED * (nanoseconds(clock, room) - began)
    return True


@njit(forceinline=True, fastmath={"reassoc"}, **_OPTIONS)
def _nothing(heap, first, count):  # type: ignore[no-untyped-def]
    """Zero times the sum of numbers: NaN, which is not zero, if one of them is not finite."""
    result = 0.0
    for k in range(count):
        result += 0.0 * heap[first + k]
    return result


@_inlined
def publish(unit, row, units, heap):  # type: ignore[no-untyped-def]
    """Make the sample in a row the component's newest, if all of it is finite."""
    if _nothing(heap, row, units[unit, WIDTH]) != 0.0:
        return False
    units[unit, NEWEST] += 1
    units[unit, TIME] += units[unit, STEP]
    units[unit, STEPS] += 1
    units[unit, FILLED] = 0
    return True


@_inlined
def _take_step(unit, clock, units, index, heap, room, control):  # type: ignore[no-untyped-def]
    """Step of a component that has its inputs; `DONE`, or what hinders it."""
    row = next_row(unit, units, heap)
    control[UNIT] = unit
    if row < 0:
        return FULL
    if units[unit, VERSION] == 0:
        control[PENDING] = unit
        return CALL
    if not _native_step(unit, row, clock, units, index, heap, room, control):
        return FAILED
    if not publish(unit, row, units, heap):
        control[STATUS], control[PHASE] = -1, GETTING
        return FAILED
    return DONE


@_compiled
def step_alone(unit, clock, units, links, index, heap, room, control):  # type: ignore[no-untyped-def]
    """Step of a component whose turn it need not be; `DONE`, or what hinders it as of `advance`.

    The inputs are filled unless they are there, and what feeds it has its samples. After `CALL` call again.
    """
    if control[PENDING] >= 0:
        row = units[unit, HISTORY] + (units[unit, NEWEST] + 1 - units[unit, BASE]) * units[unit, WIDTH]
        control[PENDING] = -1
        if publish(unit, row, units, heap):
            return DONE
        control[UNIT], control[STATUS], control[PHASE] = unit, -1, GETTING
        return FAILED
    if units[unit, FILLED] == 0:
        if not fill_inputs(unit, units[unit, TIME] + units[unit, OFFSET], units, links, index, heap, control):
            return WEIGHTS
        units[unit, FILLED] = 1
    return _take_step(unit, clock, units, index, heap, room, control)


@_inlined
def _look(group, units, groups, members):  # type: ignore[no-untyped-def]
    """Find whose turn it is in a group; members are in the order of equal times."""
    place = groups[group, FIRST_MEMBER]
    due = units[members[place], TIME]
    for k in range(place + 1, groups[group, END_OF_MEMBERS]):
        time = units[members[k], TIME]
        if time < due:
            place, due = k, time
    groups[group, TURN], groups[group, PLACE], groups[group, DUE] = members[place], place, due


@_inlined
def _look_on(group, units, groups, members):  # type: ignore[no-untyped-def]
    """Find whose turn is next when the one whose turn it was has stepped and no other: often the next is due too."""
    due = groups[group, DUE]
    for k in range(groups[group, PLACE], groups[group, END_OF_MEMBERS]):
        if units[members[k], TIME] == due:
            groups[group, TURN], groups[group, PLACE] = members[k], k
            return
    _look(group, units, groups, members)


@_inlined
def _next_group(chosen, due, groups):  # type: ignore[no-untyped-def]
    """First of the groups that are due earliest; `chosen` was it last and due at `due`, or is -1."""
    if chosen >= 0:
        for each in range(chosen, groups.shape[0]):
            if groups[each, DUE] == due:
                return np.int64(each)
    result = np.int64(0)
    for each in range(1, groups.shape[0]):
        if groups[each, DUE] < groups[result, DUE]:
            result = np.int64(each)
    return result


@_inlined
def wanting(unit, request, units, links):  # type: ignore[no-untyped-def]
    """Link of a component whose source has to be stepped first, and the number of the sample; or -1."""
    first = units[unit, FIRST_LINK]
    for link in range(first, first + units[unit, LINKS]):
        if links[link, AHEAD] == 1:
            source = links[link, SOURCE]
            if units[source, TIME] >= request + links[link, AFTER] * units[source, STEP]:
                continue
            elapsed = request - units[source, START]
            number = elapsed // units[source, STEP]
            if elapsed != number * units[source, STEP] or links[link, SMOOTH] == 1:
                number += links[link, AFTER]
            if units[source, NEWEST] < number:
                return link, number
    return -1, 0


@_compiled
def advance(  # type: ignore[no-untyped-def]
    until, budget, clock, units, links, groups, members, stack, index, heap, room, control
):
    """Step until no component has an own time before `until` (ns), or the caller is wanted; returns why.

    Parameters
    ----------
    until, budget
        End in ns, and the number of steps after which to pause.
    clock
        Address of the C library's clock, or 0.
    units, links
        Rows of whole numbers, see the columns above. Links of one target are neighbours.
    groups, members
        First and last place of a group in `members`, and its algorithm; components by group.
    stack
        Room for the groups that are stepped ahead: group, component and number of the sample.
    index, heap
        Whole numbers and numbers that the rows point into.
    room
        Address of 64 bytes.
    control
        Of the caller and the loop, see the places above; the same array at every call.
    """
    depth = control[DEPTH]
    taken = 0
    chosen, due = np.int64(-1), np.int64(0)
    for each in range(groups.shape[0]):
        _look(each, units, groups, members)
    while True:
        unit = control[PENDING]
        if unit >= 0:
            row = units[unit, HISTORY] + (units[unit, NEWEST] + 1 - units[unit, BASE]) * units[unit, WIDTH]
            control[UNIT] = unit
            if not publish(unit, row, units, heap):
                control[STATUS], control[PHASE] = -1, GETTING
                return FAILED
            _look_on(units[unit, GROUP], units, groups, members)
            taken += 1
        if unit >= 0 or unit == GROUP_STEPPED:
            control[PENDING] = -1
            if stack[depth - 1, 1] < 0:
                depth -= 1
                control[DEPTH] = depth
        if depth == 0:
            if taken >= budget:
                return PAUSE
            chosen = _next_group(chosen, due, groups)
            due = groups[chosen, DUE]
            if due >= until:
                return DONE
            stack[0, 0], stack[0, 1] = chosen, -1
            depth = 1
            control[DEPTH] = depth
        elif stack[depth - 1, 1] >= 0 and units[stack[depth - 1, 1], NEWEST] >= stack[depth - 1, 2]:
            depth -= 1
            control[DEPTH] = depth
            continue
        group = stack[depth - 1, 0]
        unit = groups[group, TURN]
        if groups[group, ALGORITHM] == CALLER:
            control[UNIT] = unit
            return GROUP_DUE
        parallel = groups[group, ALGORITHM] == PARALLEL
        if units[unit, FILLED] == 0 or (parallel and groups[group, READY] != units[unit, TIME]):
            first = groups[group, PLACE]
            last = groups[group, END_OF_MEMBERS] if parallel else first + 1
            wanted, number = -1, 0
            for k in range(first, last):
                other = members[k]
                if units[other, TIME] == units[unit, TIME] and units[other, FILLED] == 0:
                    wanted, number = wanting(other, units[other, TIME] + units[other, OFFSET], units, links)
                    if wanted >= 0:
                        break
            if wanted >= 0:
                source = links[wanted, SOURCE]
                stack[depth, 0], stack[depth, 1], stack[depth, 2] = units[source, GROUP], source, number
                depth += 1
                control[DEPTH] = depth
                continue
            for k in range(first, last):
                other = members[k]
                if units[other, TIME] == units[unit, TIME] and units[other, FILLED] == 0:
                    request = units[other, TIME] + units[other, OFFSET]
                    if not fill_inputs(other, request, units, links, index, heap, control):
                        return WEIGHTS
                    units[other, FILLED] = 1
            groups[group, READY] = units[unit, TIME]
        code = _take_step(unit, clock, units, index, heap, room, control)
        if code != DONE:
            return code
        _look_on(group, units, groups, members)
        taken += 1
        if stack[depth - 1, 1] < 0:
            depth -= 1
            control[DEPTH] = depth
