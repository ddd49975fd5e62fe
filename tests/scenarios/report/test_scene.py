"""What the animation shows: the hull's dimensions, tendons, frames, arrows, and the sea that it is carried on by."""

import base64
import json
import math
import re
import zlib
from dataclasses import replace
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from tlpsim.fmus.tables import record_to_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.platform.tendons import Tendons
from tlpsim.scenarios.report.scene import (
    FRAME_STEP,
    MOST_FRAMES,
    arrows,
    hull_geometry,
    scene_content,
    scene_scripts,
    tendon_geometry,
)
from tlpsim.scenarios.report.sea_surface import sea_surface
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

DURATION = 120.0
BASE = {
    "simulation": {"duration": DURATION, "start": "rest"},
    "platform": {"hydrodynamics": "morison", "radiation": "none"},
    "components": {"wind": {"fmu": ""}},
}


def scenario(**changes: Any) -> Scenario:
    return Scenario.from_dict(BASE).with_(**changes)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return run_scenario(scenario(), tmp_path_factory.mktemp("scene") / "r.h5")


@pytest.fixture(scope="module")
def spread_run(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A sea of three directions that rides on the current, whose elevation is recorded at the origin."""
    chosen = scenario(
        waves={"directions": 3, "displaced_position": False}, current={"speed": 1.5, "heading_deg": 0, "doppler": True}
    )
    return run_scenario(chosen, tmp_path_factory.mktemp("scene") / "r.h5")


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), dtype=np.uint8).astype(np.int64)
    folded = (raw[: packed["count"]] << 8) + raw[packed["count"] :]
    coded = (folded >> 1) ^ -(folded & 1)
    for _ in range(packed["differences"]):
        coded = np.cumsum(coded)
    return np.asarray(packed["offset"] + packed["scale"] * (coded & 0xFFFF))


def seen_as(results: Results, **changes: Any) -> Results:
    """The results, as if another scenario had been run."""
    text = results.scenario.with_(**changes).to_json()
    return replace(results, attributes=MappingProxyType({**results.attributes, "scenario": text}))


def test_the_hull_displaces_what_the_platform_weighs_and_its_tendons_pull() -> None:
    hull = hull_geometry(Scenario())
    columns = sum(math.pi * c["radius"] ** 2 * -c["bottom"] for c in hull["columns"])
    pontoons = sum(math.prod(p["size"]) for p in hull["pontoons"])
    # 40.5e6 kg and 14.0e6 kg of pretension, as published; the dimensions come from elsewhere.
    assert columns + pontoons == pytest.approx((40.5e6 + 14.0e6) / 1025.0, rel=1e-3)


def test_columns_and_pontoons_have_the_published_dimensions() -> None:
    hull = hull_geometry(Scenario())
    assert {(abs(c["x"]), abs(c["y"])) for c in hull["columns"]} == {(43.125, 43.125)}
    assert {(c["radius"], c["bottom"]) for c in hull["columns"]} == {(8.435, -35.0)}
    assert {p["centre"][2] - 0.5 * p["size"][2] for p in hull["pontoons"]} == {-35.0}
    assert {tuple(sorted(p["size"])) for p in hull["pontoons"]} == {(7.5, 10.5, 86.25 - 2 * 8.435)}
    for pontoon in hull["pontoons"]:  # between two columns' walls, on the line of their centres
        along = int(np.argmax(pontoon["size"][:2]))
        assert abs(pontoon["centre"][1 - along]) == 43.125
        assert pontoon["size"][along] / 2 + 8.435 == pytest.approx(43.125)


def test_hull_and_tendons_go_with_the_draught() -> None:
    deeper = scenario(platform={"draught": 30.0})
    hull = hull_geometry(deeper)
    assert {c["bottom"] for c in hull["columns"]} == {-30.0}
    assert {p["centre"][2] - 0.5 * p["size"][2] for p in hull["pontoons"]} == {-30.0}


def test_the_deck_is_what_the_wind_blows_on() -> None:
    boxes = [
        {"position": [0, 0, 40], "size": [90, 80, 12], "shape_coefficient": 1.2},
        {"position": [40, 0, 10], "size": [9, 9, 20], "shape_coefficient": 1.0},  # stands on the water
    ]
    hull = hull_geometry(scenario(wind={"boxes": boxes}))
    assert hull["deck"] == [{"centre": box["position"], "size": box["size"]} for box in boxes]
    assert {c["top"] for c in hull["columns"]} == {34.0}
    plain = hull_geometry(Scenario())
    (deck,) = plain["deck"]
    assert deck["centre"][2] - 0.5 * deck["size"][2] == issc_tlp.DECK_HEIGHT == plain["columns"][0]["top"]


def test_tendons_go_from_the_keel_at_the_columns_to_the_sea_bed_and_stand_apart() -> None:
    geometry = tendon_geometry(issc_tlp.tendons())
    fairleads, anchors, aside = (np.array(geometry[name]) for name in ("fairleads", "anchors", "aside"))
    assert fairleads.shape == anchors.shape == (12, 3)
    np.testing.assert_array_equal(np.abs(fairleads), np.tile([43.125, 43.125, 35.0], (12, 1)))
    np.testing.assert_array_equal(anchors, fairleads - [0.0, 0.0, 415.0])
    assert np.hypot(*aside.T).max() < 8.435
    for first in range(0, 12, 3):
        group = aside[first : first + 3]
        np.testing.assert_allclose(group.sum(axis=0), 0.0, atol=1e-12)
        assert min(np.hypot(*(group[i] - group[i - 1])) for i in range(3)) > 3.0


def test_tendons_with_places_of_their_own_are_drawn_there(run: Results) -> None:
    given = issc_tlp.tendons()
    apart = np.repeat([[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.0]], 4, axis=0).reshape(3, 4, 3)
    apart = apart.transpose(1, 0, 2).reshape(12, 3)
    own = Tendons(
        fairleads=given.fairleads + apart,
        anchors=given.anchors + apart,
        axial_stiffness=given.axial_stiffness,
        pretension=given.pretension,
    )
    given_text = {"platform": {"parameters": {"tendons": record_to_json(own)}}}
    content = scene_content(seen_as(run, components=given_text))
    assert content is not None
    np.testing.assert_allclose(content["tendons"]["fairleads"], own.fairleads)
    assert not np.any(content["tendons"]["aside"])


def test_frames_are_the_recorded_motions_and_tensions(run: Results) -> None:
    content = scene_content(run)
    assert content is not None
    assert content["time"] == {"start": 0.0, "step": FRAME_STEP, "count": 241}
    every = round(FRAME_STEP / 0.1)
    for packed, degree in zip(content["position"], ("surge", "sway", "heave", "roll", "pitch", "yaw"), strict=True):
        recorded = run.signal(f"platform.position.{degree}")[::every]
        np.testing.assert_allclose(unpacked(packed), recorded, rtol=0.0, atol=np.ptp(recorded) / 65534)
    tension = content["tension"]
    for number, series in enumerate(tension["of"]):
        recorded = run.signal(f"platform.tendon_tension[{number + 1}]")[::every]
        np.testing.assert_allclose(unpacked(tension["series"][series]), recorded, rtol=0.0, atol=np.ptp(recorded) / 6e4)
    assert tension["lost"] == [None] * 12
    assert len(tension["series"]) == 4  # the three of a column, at one place, pull alike


def test_three_hours_fit_into_three_megabytes(run: Results) -> None:
    content = scene_content(run)
    assert content is not None
    assert len(json.dumps(content)) * MOST_FRAMES / content["time"]["count"] < 3e6


def test_of_a_long_run_the_stretch_about_the_largest_tension_is_shown(run: Results) -> None:
    tensions = np.array([run.signal(f"platform.tendon_tension[{k + 1}]") for k in range(12)])
    largest = float(run.time("platform")[np.argmax(tensions.max(axis=0))])
    content = scene_content(run, most_frames=41)
    assert content is not None
    shown = content["time"]
    assert shown["count"] == 41
    assert shown["start"] <= largest <= shown["start"] + 40 * FRAME_STEP
    assert any(note.startswith("Shown: ") for note in content["notes"])


@pytest.mark.parametrize(
    ("start", "first", "count"), [(0.0, 0.0, 41), (30.2, 30.0, 41), (110.0, 110.0, 21), (1e4, 119.5, 2)]
)
def test_a_stretch_that_is_asked_for(run: Results, start: float, first: float, count: int) -> None:
    content = scene_content(run, start=start, most_frames=41)
    assert content is not None
    assert content["time"] == {"start": first, "step": FRAME_STEP, "count": count}


def test_arrows_are_the_scenarios_headings() -> None:
    rows = {row["name"]: row for row in arrows(Scenario())}
    assert {name: math.degrees(row["heading"]) for name, row in rows.items()} == pytest.approx(
        {"wind": 34.5, "waves": 21.6, "current": 96.0}
    )
    assert "26.9 m/s" in rows["wind"]["label"]
    assert "Hs 7.08 m" in rows["waves"]["label"]
    turning = {"depth": [0.0, 50.0], "speed": [0.8, 0.1], "heading_deg": [10.0, 80.0]}
    (current,) = (row for row in arrows(scenario(current={"table": turning})) if row["name"] == "current")
    assert (math.degrees(current["heading"]), current["label"][:7]) == (pytest.approx(10.0), "0.8 m/s")


def test_what_there_is_not_has_no_arrow() -> None:
    still = scenario(wind={"speed": 0.0}, waves={"significant_height": 0.0}, current={"speed": 0.0})
    assert arrows(still) == []
    assert [row["name"] for row in arrows(scenario())] == ["waves", "current"]


def test_the_current_turns_with_the_events() -> None:
    chosen = scenario(
        current={"speed": 0.4, "heading_deg": 96.0},
        events=[{"at": 60.0, "current": {"speed": 0.0}}, {"at": 30.0, "current": {"heading_deg": -20.0}}],
    )
    rows = [row for row in arrows(chosen) if row["name"] == "current"]
    assert [(math.degrees(row["heading"]), row["from"], row["until"]) for row in rows] == [
        (pytest.approx(96.0), None, 30.0),
        (pytest.approx(-20.0), 30.0, 60.0),
    ]


def test_no_position_no_scene(tmp_path: Path) -> None:
    chosen = scenario(simulation={"duration": 2.0}, outputs={"signals": ["wave.*", "platform.velocity.*"]})
    assert scene_content(run_scenario(chosen, tmp_path / "r.h5")) is None


def test_a_missing_degree_is_told_and_missing_tensions_are_none(tmp_path: Path) -> None:
    chosen = scenario(simulation={"duration": 2.0}, outputs={"signals": ["platform.position.s*"]})
    content = scene_content(run_scenario(chosen, tmp_path / "r.h5"))
    assert content is not None
    assert content["tension"] is None
    assert content["sea"] is None
    assert any("position.heave, position.roll" in note for note in content["notes"])


def test_a_lost_tendon_is_told_from_a_slack_one(tmp_path: Path) -> None:
    (tmp_path / "loss.csv").write_text("time [s],first [1],second [1]\n0,1,1\n10,0,0\n12,0,1\n")
    loss = {"fmu": str(tmp_path / "loss.csv"), "step": 0.1, "parameters": {"interpolation": "hold", "beyond": "hold"}}
    ends = {f"platform.tendon_intact[{k}]": {"from": f"loss.{name}"} for k, name in ((2, "first"), (7, "second"))}
    late = [{"at": 27.0, "lose_tendons": [12]}]
    chosen = scenario(simulation={"duration": 30.0}, components={"loss": loss}, connections=ends, events=late)
    content = scene_content(run_scenario(chosen, tmp_path / "r.h5"))
    assert content is not None
    lost = content["tension"]["lost"]
    assert lost[1] == pytest.approx(10.0, abs=0.11)
    assert {k: time for k, time in enumerate(lost) if time is not None} == {1: lost[1], 11: 27.0}
    seventh = unpacked(content["tension"]["series"][content["tension"]["of"][6]])
    assert seventh[22] <= content["tension"]["slack"][6] < seventh[26]


def test_scripts_are_one_text_without_an_end_of_their_element() -> None:
    text = scene_scripts()
    assert "</script" not in text
    assert text.index("tlpsimThree") < text.index("window.tlpsimSea =") < text.index("window.tlpsimScene =")


def test_the_library_holds_what_the_scripts_use() -> None:
    assets = resources.files("tlpsim.scenarios.report") / "assets"
    scripts = (assets / "world.js").read_text() + (assets / "scene.js").read_text()
    used = set(re.findall(r"\bthree\.([A-Z]\w+)", scripts))
    entry = (assets / "vendor" / "three_entry.js").read_text().split("\nexport", 1)[1]
    assert used == set(re.findall(r"\b[A-Z]\w+\b", entry.replace("OrbitControls.js", "")))
    bundle = (assets / "vendor" / "three.bundle.min.js").read_text()
    assert all(f"{name}:()=>" in bundle for name in used)


# The sea


def frames(results: Results) -> np.ndarray:
    return np.arange(0.0, results.time("platform")[-1] + 1e-9, FRAME_STEP)


def test_a_long_crested_sea_is_the_record_and_the_dispersion_relation(run: Results) -> None:
    shallow = seen_as(run, site={"water_depth": 60.0})
    surface = sea_surface(shallow, frames(run))
    assert surface is not None
    assert surface.at_platform
    assert np.degrees(surface.heading) == pytest.approx([21.6])
    recorded = run.signal("wave.elevation")
    np.testing.assert_allclose(surface.elevation[0, surface.half : -surface.half], recorded, atol=1e-9)
    for f, k in list(zip(surface.frequency, surface.wavenumber[0], strict=True))[::20]:
        omega2 = (2.0 * math.pi * f) ** 2
        expected = brentq(lambda k, w=omega2: 9.80665 * k * math.tanh(60.0 * k) - w, 1e-9, 10.0)
        assert k == pytest.approx(expected, rel=1e-9)


def test_beyond_the_run_the_record_is_mirrored(run: Results) -> None:
    surface = sea_surface(run, frames(run))
    assert surface is not None
    series, half = surface.elevation[0], surface.half
    np.testing.assert_allclose(series[half - 100 : half], series[half + 1 : half + 101][::-1], atol=1e-9)
    np.testing.assert_allclose(series[-half : -half + 100], series[-half - 101 : -half - 1][::-1], atol=1e-9)


def test_a_spread_sea_is_made_again_and_adds_up_to_the_record(spread_run: Results) -> None:
    surface = sea_surface(spread_run, frames(spread_run))
    assert surface is not None
    assert not surface.at_platform
    assert "3 directions" in surface.note
    assert len(surface.heading) == 3
    assert np.degrees(surface.heading.mean()) == pytest.approx(21.6)
    total = surface.elevation[:, surface.half : -surface.half].sum(axis=0)
    recorded = spread_run.signal("wave.elevation")
    assert np.std(total - recorded) < 0.01 * np.std(recorded)


def test_waves_on_a_current_have_the_wavenumbers_of_that(spread_run: Results) -> None:
    surface = sea_surface(spread_run, frames(spread_run))
    assert surface is not None
    omega, flow = 2.0 * np.pi * surface.frequency, 1.5 * np.cos(surface.heading)[:, None]
    k = surface.wavenumber
    np.testing.assert_allclose((omega - k * flow) ** 2, 9.80665 * k * np.tanh(450.0 * k), rtol=1e-8)
    assert len(np.unique(k, axis=0)) == 3


@pytest.mark.parametrize("generator", ["arma", "harmonic"])
def test_another_sea_than_the_recorded_one_is_not_shown(spread_run: Results, run: Results, generator: str) -> None:
    other = seen_as(spread_run, waves={"seed": 99, "generator": generator})
    surface = sea_surface(other, frames(spread_run))
    assert surface is not None
    assert len(surface.heading) == 1
    assert "long-crested in the mean heading" in surface.note


def test_a_spread_sea_of_components_is_made_again(tmp_path: Path) -> None:
    chosen = scenario(waves={"directions": 2, "generator": "harmonic", "components": 60})
    results = run_scenario(chosen, tmp_path / "r.h5")
    surface = sea_surface(results, frames(results))
    assert surface is not None
    assert len(surface.heading) == 2
    # At the origin the elevation is not what was recorded some metres off, but has its spread.
    total = surface.elevation[:, surface.half : -surface.half].sum(axis=0)
    recorded = results.signal("wave.elevation")
    assert 0.01 * np.std(recorded) < np.std(total - recorded) < 0.35 * np.std(recorded)


def test_calm_water_has_no_surface(tmp_path: Path) -> None:
    chosen = scenario(simulation={"duration": 5.0}, waves={"significant_height": 0.0})
    content = scene_content(run_scenario(chosen, tmp_path / "r.h5"))
    assert content is not None
    assert content["sea"] is None
    assert any("calm" in note for note in content["notes"])
