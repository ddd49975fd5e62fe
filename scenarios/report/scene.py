"""What the animation in a report shows of a run: hull, tendons, their motion and tensions, sea, wind and current.

`scene_content` makes it from results, the scripts `assets/sea.js`, `world.js` and `scene.js` draw it. Everything is in
the axes of docs/conventions.md: x and y horizontal, z up from mean water level, headings the directions of propagation.
The hull is that of `tlpsim.loads.issc_tlp` at the scenario's draught, as it is what scenarios have; no scenario says
what the deck looks like: it is the boxes that the wind blows on, or a plain one. Columns end at its underside.
"""

from __future__ import annotations

import math
import warnings
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.fmus.tables import record_from_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.platform.tendons import Tendons, line_lengths
from tlpsim.scenarios.event_sections import Event
from tlpsim.scenarios.events import ordered
from tlpsim.scenarios.parameters import scenario_tendons
from tlpsim.scenarios.report.packing import pack
from tlpsim.scenarios.report.sea_surface import EXTENT, REACH, sea_surface
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.sections import BUILTIN
from tlpsim.scenarios.statistics.summary import conversion, extreme_tensions

FloatArray = NDArray[np.float64]

FRAME_STEP = 0.5
"""s, between two frames: a quarter of the period of the tendon modes, and enough for waves."""
MOST_FRAMES = 21_601
"""Three hours."""
PLAIN_DECK_HEIGHT = 8.0
"""m, of the deck where the scenario gives no boxes; for the picture only."""
LOST_AFTER = 10.0
"""s; a tendon without tension for so long, to the end of the record, is lost, and not slack for a moment."""
SPREAD_RADIUS = 0.45
"""Of the column's radius: so far from their common place tendons are drawn that stand at one place."""

SCRIPTS = ("vendor/three.bundle.min.js", "sea.js", "world.js", "scene.js")
"""Of the folder `assets`, in this order; then `tlpsimScene.mount(element, content, unpack)` draws the content."""


def scene_scripts() -> str:
    """The scripts of the animation as one, for an HTML script element."""
    folder = resources.files("tlpsim.scenarios.report") / "assets"
    return "\n".join((folder / name).read_text(encoding="utf-8") for name in SCRIPTS).replace("</script", "<\\/script")


def scene_content(
    results: Results, *, start: float | None = None, most_frames: int = MOST_FRAMES
) -> dict[str, Any] | None:
    """What the animation shows, as JSON can hold it; arrays are of `tlpsim.scenarios.report.packing`.

    Parameters
    ----------
    results
        Of a run, complete or not.
    start
        First time shown, s. Without it the whole run is shown; of one with more frames than `most_frames`, the stretch
        about its largest tension, or its beginning where no tension was recorded.
    most_frames
        Frames, `FRAME_STEP` apart, >= 2.

    Returns
    -------
    None where no position of the platform was recorded, or of a system that comes from no scenario.
    """
    if not results.has_scenario or "platform" not in results.components:
        return None
    recorded = results.signals("platform")
    time = results.time("platform")
    names = [f"position.{degree}" for degree in DEGREES_OF_FREEDOM]
    if not any(name in recorded for name in names) or len(time) < 2 or time[-1] - time[0] < FRAME_STEP:
        return None
    times = _frame_times(results, time, start, most_frames)
    scenario = results.scenario
    positions = [_series(results, name, times, unit) for name, unit in zip(names, _UNITS, strict=True)]
    tendons = _tendons(scenario)
    content: dict[str, Any] = {
        "time": {"start": float(times[0]), "step": FRAME_STEP, "count": len(times)},
        "position": [pack(each) for each in positions],
        "hull": hull_geometry(scenario),
        "tendons": tendon_geometry(tendons),
        "tension": _tension(results, tendons, times),
        "water_depth": scenario.site.water_depth,
        "extent": EXTENT,
        "arrows": arrows(scenario),
        "sea": None,
        "notes": _notes(scenario, results, times, time, [name for name in names if name not in recorded]),
    }
    surface = sea_surface(results, times)
    if surface is None:
        content["notes"].append("Sea: calm, or no elevation was recorded.")
        return content
    content["notes"].append(f"Sea: {surface.note}.")
    numbers, which = np.unique(surface.wavenumber, axis=0, return_inverse=True)
    content["sea"] = {
        "heading": surface.heading.tolist(),
        "elevation": [pack(each) for each in surface.elevation],
        "half": surface.half,
        "reach": REACH,
        "frequency": surface.frequency.tolist(),
        "wavenumber": numbers.tolist(),
        "wavenumber_of": which.ravel().tolist(),
        "at_platform": surface.at_platform,
    }
    return content


_UNITS = ("m", "m", "m", "rad", "rad", "rad")


def _frame_times(results: Results, time: FloatArray, start: float | None, most_frames: int) -> FloatArray:
    """Times of the frames, s, evenly spaced within the record, at least two."""
    whole = int((time[-1] - time[0]) / FRAME_STEP + 1e-6) + 1
    count = max(min(whole, most_frames), 2)
    first = 0
    if start is not None:
        first = math.floor((start - time[0]) / FRAME_STEP)
    elif whole > most_frames:
        extremes = extreme_tensions(results)
        first = 0 if extremes is None else round((extremes.maximum_time - time[0]) / FRAME_STEP) - count // 2
    first = min(max(first, 0), whole - 2 if start is not None else whole - count)
    return np.asarray(time[0] + FRAME_STEP * np.arange(first, min(first + count, whole)))


def _series(results: Results, variable: str, times: FloatArray, unit: str) -> FloatArray:
    """A signal of the platform at `times`, in `unit`; zeros where it was not recorded."""
    if variable not in results.signals("platform"):
        return np.zeros(len(times))
    name = f"platform.{variable}"
    return np.interp(times, results.time("platform"), conversion(results.unit(name), unit) * results.signal(name))


def _tendons(scenario: Scenario) -> Tendons:
    """Those of the platform FMU; of another FMU in its place, those that the scenario describes."""
    entry = scenario.components["platform"]
    given = entry.parameters.get("tendons") if entry.fmu == f"{BUILTIN}platform" else None
    return record_from_json(Tendons, str(given), "tendons") if given else scenario_tendons(scenario)


def hull_geometry(scenario: Scenario) -> dict[str, Any]:
    """Columns and boxes of hull and deck, in body axes from the reference point, m.

    Returns
    -------
    ``columns``, each with ``x``, ``y``, ``radius``, ``bottom``, ``top``; ``pontoons`` and ``deck``, each of ``centre``
    and ``size``, both (3,).
    """
    draught, half = scenario.platform.draught, 0.5 * issc_tlp.COLUMN_SPACING
    boxes = scenario.wind.boxes
    if boxes:
        deck = [{"centre": list(box.position), "size": list(box.size)} for box in boxes]
    else:
        side = issc_tlp.COLUMN_SPACING + 2.0 * issc_tlp.COLUMN_RADIUS
        centre = [0.0, 0.0, issc_tlp.DECK_HEIGHT + 0.5 * PLAIN_DECK_HEIGHT]
        deck = [{"centre": centre, "size": [side, side, PLAIN_DECK_HEIGHT]}]
    undersides = [box["centre"][2] - 0.5 * box["size"][2] for box in deck]
    # A box that stands on the water is a column or a shaft, on which no deck rests.
    top = min((height for height in undersides if height > 1.0), default=issc_tlp.DECK_HEIGHT)
    between = issc_tlp.COLUMN_SPACING - 2.0 * issc_tlp.COLUMN_RADIUS
    level = -draught + 0.5 * issc_tlp.PONTOON_HEIGHT
    along_x = [between, issc_tlp.PONTOON_WIDTH, issc_tlp.PONTOON_HEIGHT]
    along_y = [issc_tlp.PONTOON_WIDTH, between, issc_tlp.PONTOON_HEIGHT]
    return {
        "columns": [
            {"x": float(x), "y": float(y), "radius": issc_tlp.COLUMN_RADIUS, "bottom": -draught, "top": top}
            for x, y in issc_tlp.COLUMN_CENTRES
        ],
        "pontoons": [
            {"centre": [0.0, -half, level], "size": along_x},
            {"centre": [0.0, half, level], "size": along_x},
            {"centre": [-half, 0.0, level], "size": along_y},
            {"centre": [half, 0.0, level], "size": along_y},
        ],
        "deck": deck,
    }


def tendon_geometry(tendons: Tendons) -> dict[str, Any]:
    """Ends of the tendons, m, and how far from there each is drawn, so that those at one place can be told apart.

    Returns
    -------
    ``fairleads`` in body axes and ``anchors``, (n, 3) each; ``aside`` (n, 2), horizontal, of both ends; ``diameter``
    (n,).
    """
    fairleads = tendons.fairleads
    aside = np.zeros((len(fairleads), 2))
    ends = np.round(np.hstack([fairleads, tendons.anchors]), 3)
    for place in np.unique(ends, axis=0):
        together = np.flatnonzero(np.all(ends == place, axis=1))
        if len(together) < 2:
            continue
        outward = math.atan2(place[1], place[0])
        angles = outward + 2.0 * np.pi * np.arange(len(together)) / len(together)
        aside[together] = SPREAD_RADIUS * issc_tlp.COLUMN_RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])
    return {
        "fairleads": fairleads.tolist(),
        "anchors": tendons.anchors.tolist(),
        "aside": aside.tolist(),
        "diameter": tendons.diameter.tolist(),
    }


def _tension(results: Results, tendons: Tendons, times: FloatArray) -> dict[str, Any] | None:
    """Tensions of the tendons at `times`, N; None where they were not all recorded.

    Returns
    -------
    ``series`` that differ, packed; ``of``, the place of each tendon's among them; ``slack``, the tension up to which a
    tendon is slack (eq. (4) of `tlpsim.loads.platform.tendons`), N; ``lost``, the time from which it is lost, by an
    event or as the record has it, or None.
    """
    count = len(tendons.fairleads)
    names = [f"tendon_tension[{number + 1}]" for number in range(count)]
    if count == 0 or not all(name in results.signals("platform") for name in names):
        return None
    time = results.time("platform")
    by_event = {number: event.at for event, _ in reversed(_events(results.scenario)) for number in event.lose_tendons}
    slack = np.abs(0.5 * tendons.submerged_weight * line_lengths(tendons)) + 1e-3 * tendons.pretension
    series: dict[bytes, int] = {}
    packed: list[dict[str, Any]] = []
    of: list[int] = []
    lost: list[float | None] = []
    for number, name in enumerate(names, start=1):
        whole = conversion(results.unit(f"platform.{name}"), "N") * results.signal(f"platform.{name}")
        taut = np.flatnonzero(whole > 0.0)
        gone = float(time[min(taut[-1] + 1, len(time) - 1)] if len(taut) else time[0])
        lost.append(by_event.get(number, gone if time[-1] - gone >= LOST_AFTER else None))
        shown = np.interp(times, time, whole)
        if shown.tobytes() not in series:  # tendons at one place have one tension: it is kept once
            series[shown.tobytes()] = len(packed)
            packed.append(pack(shown))
        of.append(series[shown.tobytes()])
    return {
        "series": packed,
        "of": of,
        "slack": slack.tolist(),
        "lost": lost,
    }


def arrows(scenario: Scenario) -> list[dict[str, Any]]:
    """Wind, waves and current: ``name``, ``heading`` (rad, where they go) and ``label`` of each that there is.

    Each is there for the times ``from`` <= t < ``until``, s, or None for no end. Of forces from a table no heading is
    known, and there is no arrow.
    """
    wind, waves = scenario.wind, scenario.waves
    sea = "spectrum of a table" if waves.table else f"Hs {waves.significant_height:g} m, Tp {waves.peak_period:g} s"
    if waves.directions > 1:
        sea += f", {waves.directions} directions"
    there = {name for name, entry in scenario.components.items() if not entry.is_table}
    rows: list[tuple[str, bool, float, str, float | None, float | None]] = [
        ("wind", "wind" in there and wind.speed > 0.0, wind.heading_deg, f"{wind.speed:.3g} m/s", None, None),
        ("waves", "wave" in there and waves.significant_height > 0.0, waves.heading_deg, sea, None, None),
    ]
    changes = [(event.at, after) for event, after in _events(scenario) if event.current is not None]
    begins = [None, *(at for at, _ in changes)]
    for begin, end, each in zip(begins, [*begins[1:], None], [scenario, *(after for _, after in changes)], strict=True):
        current, table = each.current, each.current.table
        speed, heading = (
            (current.speed, current.heading_deg) if table is None else (table.speed[0], table.heading_deg[0])
        )
        flows = bool(there & {"wave", "platform"}) and speed > 0.0
        rows.append(("current", flows, heading, f"{speed:.3g} m/s at the surface", begin, end))
    return [
        {
            "name": name,
            "heading": math.radians(degrees),
            "label": f"{label}, to {degrees:g}°",
            "from": begin,
            "until": end,
        }
        for name, exists, degrees, label, begin, end in rows
        if exists
    ]


def _events(scenario: Scenario) -> list[tuple[Event, Scenario]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of events after the end, which the run gave
        return ordered(scenario)


def _notes(scenario: Scenario, results: Results, times: FloatArray, time: FloatArray, missing: list[str]) -> list[str]:
    """What a reader must know of how the picture is made."""
    notes = []
    if times[0] > time[0] + FRAME_STEP or times[-1] < time[-1] - FRAME_STEP:
        notes.append(f"Shown: {times[0]:g} to {times[-1]:g} s of a run of {time[-1]:g} s.")
    if not results.complete:
        notes.append(f"The run is not complete ({results.status}).")
    if missing:
        notes.append(f"Not recorded, and drawn as zero: {', '.join(missing)}.")
    own = scenario.components["platform"].fmu == f"{BUILTIN}platform"
    hull = "Hull: the ISSC TLP's shape at the scenario's draught, to scale"
    if not own or scenario.platform.hydrodynamics.endswith(".h5"):
        hull += ", whatever the hull of the files that the run used"
    notes.append(hull + ("." if scenario.wind.boxes else "; a plain deck, as the scenario has no boxes for the wind."))
    notes.append("Tendons are drawn thicker than they are; those of a column, which act at its centre, side by side.")
    return notes
