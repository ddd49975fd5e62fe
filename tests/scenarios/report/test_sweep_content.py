"""The page of a sweep as data: what governs, what needs a look, what the scripts are given."""

import base64
import json
import re
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from sweep_by_hand import (
    HEADING,
    HEIGHT,
    MEAN,
    PERIOD,
    SURGE,
    SWAY,
    TENSION,
    fail,
    only,
    surge,
    table,
    tensions,
)

from tlpsim.scenarios.report.document import Block, Chart, Checks, Document, Facts, Fold, Grid, Table
from tlpsim.scenarios.report.page import page
from tlpsim.scenarios.report.sweep_content import sweep_document
from tlpsim.scenarios.report.sweep_data import levels, packed_sweep, packed_whole, sweep
from tlpsim.scenarios.report.sweep_words import key_labels, key_unit, value_text, variant_labels


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    """Values of a packed array, by the format's description."""
    count = packed["count"]
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), dtype=np.uint8).astype(np.uint16)
    folded = raw[:count] << 8 | raw[count:]
    coded = folded >> 1 ^ -(folded & 1).astype(np.int16).astype(np.uint16)
    for _ in range(packed["differences"]):
        coded = np.cumsum(coded, dtype=np.uint16)
    return np.where(coded == 65535, np.nan, packed["offset"] + packed["scale"] * coded)


def whole(packed: dict[str, Any]) -> list[int]:
    return (np.rint(unpacked(packed["low"])) + 32768 * np.rint(unpacked(packed["high"]))).astype(int).tolist()


def cards(document: Document) -> dict[str, tuple[str, str]]:
    found = next(each for each in document.head if isinstance(each, Facts))
    return {name: (cell.text, cell.below) for name, cell in found.entries}


def checks(document: Document) -> dict[str, tuple[bool | None, str]]:
    found = next(each for each in document.head if isinstance(each, Checks))
    return {what: (good, text) for good, what, text in found.entries}


def blocks(document: Document, anchor: str) -> tuple[Block, ...]:
    return next(each.blocks for each in document.sections if each.anchor == anchor)


def test_names_and_units_of_keys() -> None:
    names = key_labels([HEIGHT, HEADING, "wind.heading_deg", "wind.speed", "a.b.one_thing", "c.one_thing"])
    assert list(names.values()) == [
        "significant height",
        "waves heading",
        "wind heading",
        "wind speed",
        "a b one thing",
        "c one thing",
    ]
    assert [key_unit(key) for key in (HEIGHT, PERIOD, HEADING, "platform.mass", "platform.roll_inertia")] == [
        "m",
        "s",
        "deg",
        "kg",
        "kg·m²",
    ]
    assert key_unit("platform.tendons.pretension") == "N"
    assert key_unit("nothing.of.the.kind") == key_unit("waves.spectrum") == ""


def test_values_in_words() -> None:
    assert value_text(12.5, "m") == "12.5 m"
    assert value_text(-3) == "−3"
    assert value_text("jonswap", "m") == "jonswap"
    assert value_text([1, 7]) == "[1, 7]"
    assert value_text(True) == "true"
    assert value_text(float("nan"), "m") == "–"
    assert value_text(40.5e6, "kg") == "40\u202f500\u202f000 kg"
    assert variant_labels(({},)) == ("",)
    assert variant_labels(({"platform.draught": 35.0}, {})) == ("1: platform draught 35 m", "2: as given")


def test_levels_of_a_key() -> None:
    numbers, which = levels(np.array([4.0, 2.0, np.nan, 4.0]))
    assert (numbers, which.tolist()) == ([2.0, 4.0], [1, 0, 2, 1])
    texts, which = levels(np.array(["b", "a", "b"], dtype=object))
    assert (texts, which.tolist()) == (["b", "a"], [0, 1, 0])


def test_what_governs_is_the_worst_mean_over_replicates_with_its_case() -> None:
    found = cards(sweep_document(table()))
    largest = surge(8.0, 12.0, 0.0) * MEAN  # beyond the frequency domain's, since the mean of the factors is above 1
    assert MEAN > 1.0
    text, below = found["Largest surge in 3 h"]
    assert text == f"{largest:.1f} m"
    assert below == (
        "case 22, time domain: significant height 8 m, peak period 12 s, waves heading 0 deg"
    )  # the last but one of 4 x 3 x 2
    highest, lowest = tensions(8.0, 90.0)
    text, below = found["Highest tension in 3 h"]
    assert text == f"{1e-6 * highest * MEAN:.1f} MN"
    assert below.startswith("tendon 1; case 19, time domain: significant height 8 m, peak period 8 s")
    text, below = found["Lowest tension in 3 h"]
    assert text == f"{1e-6 * lowest:.2f} MN"
    assert below.startswith("tendon 2; case 18, frequency domain")
    assert "damage" not in " ".join(found)


def test_an_extreme_of_either_sign_keeps_its_sign() -> None:
    def negative(rows: list[dict[str, Any]]) -> None:
        rows[0][f"{SURGE}.expected_minimum"] = -40.0

    text, below = cards(sweep_document(table(change=negative)))["Largest surge in 3 h"]
    assert text == "−40.0 m"
    assert below.startswith("case 0, frequency domain")


def test_nothing_needs_a_look_where_all_is_well() -> None:
    found = checks(sweep_document(table()))
    assert {what: good for what, (good, _) in found.items()} == {
        "Jobs": True,
        "Probability covered": True,
        "Tendons": True,
        "Time and frequency domain": True,
    }
    assert found["Jobs"][1] == "all 96 jobs are done"
    assert f"{MEAN:.3f} on the average for surge" in found["Time and frequency domain"][1]


def test_failed_and_missing_jobs_are_told() -> None:
    def two(rows: list[dict[str, Any]]) -> None:
        fail(rows[0], "ScenarioError: too steep")  # the frequency domain of case 0
        fail(rows[5], "killed")  # one replicate of case 1, the others of which are done

    document = sweep_document(table(change=two, planned=100))
    found = checks(document)
    assert found["Jobs"] == (False, "4 of 100 jobs not finished, 2 of 96 jobs failed")
    told = "all of it in one domain; frequency domain: 95.83 % (4.16 % in failed cases)"
    assert found["Probability covered"] == (True, told)
    assert document.status == found["Jobs"][1]
    assert not document.complete
    (failed,) = blocks(document, "failed")
    assert isinstance(failed, Table)
    assert failed.headings == ("case", "domain", "replicate", "settings", "error")
    settings = "significant height 2 m, peak period 8 s, waves heading 0 deg"
    assert failed.rows[0].heading == "0"
    assert failed.rows[0].cells == ("frequency", "0", settings, "ScenarioError: too steep")
    assert [row.cells[-1] for row in failed.rows] == ["ScenarioError: too steep", "killed"]


def test_probability_that_no_domain_has_needs_a_look() -> None:
    def first(rows: list[dict[str, Any]]) -> None:
        for row in rows[:4]:  # all jobs of case 0
            fail(row, "no")

    told = "(4.16 % in failed cases)"
    assert checks(sweep_document(table(change=first)))["Probability covered"] == (
        False,
        f"frequency domain: 95.83 % {told}; time domain: 95.83 % {told}",
    )

    def last(rows: list[dict[str, Any]]) -> None:
        del rows[4:]  # others are not in the table

    found = checks(sweep_document(table(change=last)))["Probability covered"]
    assert found == (False, "frequency domain: 4.16 %; time domain: 4.16 %")


def test_without_probabilities_nothing_is_said_of_their_sum() -> None:
    def none(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row["probability"] = np.nan

    good, text = checks(sweep_document(table(change=none)))["Probability"]
    assert good is None
    assert text == "no probabilities of sea states are given"


@pytest.mark.parametrize(
    ("name", "told"), [("minimum", "in records in 1 case"), ("expected_minimum", "expected in 1 case")]
)
def test_slack_tendons_need_a_look(name: str, told: str) -> None:
    def slack(rows: list[dict[str, Any]]) -> None:
        rows[1][f"{TENSION}[2].{name}"] = 0.0

    assert checks(sweep_document(table(change=slack)))["Tendons"] == (False, f"without tension at times: {told}")


def test_domains_that_differ_need_a_look() -> None:
    def off(rows: list[dict[str, Any]]) -> None:
        for row in rows[:4]:  # case 0: its replicates are 1.3 times what they were
            row[f"{SURGE}.std"] *= 1.3 if row["domain"] == "time" else 1.0

    good, text = checks(sweep_document(table(change=off)))["Time and frequency domain"]
    assert good is False
    assert f"{1.3 * MEAN:.2f} in the farthest case (surge, case 0)" in text
    assert text.endswith("in 1 of 24 cases by more than 10 % and in each replicate")

    def all_off(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row[f"{SURGE}.std"] *= 0.8 if row["domain"] == "time" else 1.0

    good, text = checks(sweep_document(table(change=all_off)))["Time and frequency domain"]
    assert good is False
    assert f"{0.8 * MEAN:.3f} on the average for surge" in text


def test_one_record_that_scatters_needs_no_look() -> None:
    def one(rows: list[dict[str, Any]]) -> None:
        rows[1][f"{SURGE}.std"] *= 1.6

    assert checks(sweep_document(table(change=one)))["Time and frequency domain"][0] is True


def test_a_motion_across_the_weather_is_no_news() -> None:
    def across(size: float) -> Callable[[list[dict[str, Any]]], None]:
        def change(rows: list[dict[str, Any]]) -> None:
            for row in rows:
                row.update({f"{SWAY}.{name}": size * row[f"{SURGE}.{name}"] for name in ("mean", "expected_maximum")})
                row[f"{SWAY}.expected_minimum"] = size * row[f"{SURGE}.expected_minimum"]
                row[f"{SWAY}.std"] = size * (5.0 if row["domain"] == "time" else 1.0)

        return change

    slight, large = (sweep_document(table(change=across(size), units={SURGE: "m", SWAY: "m"})) for size in (1e-3, 0.5))
    assert "Largest sway in 3 h" not in cards(slight)
    assert checks(slight)["Time and frequency domain"][0] is True
    assert "Largest sway in 3 h" in cards(large)
    assert checks(large)["Time and frequency domain"][0] is False


def test_alternatives_stand_side_by_side() -> None:
    document = sweep_document(
        table(
            variants=({"platform.draught": 35.0}, {"platform.draught": 38.0}),
            keys=(HEIGHT, PERIOD, HEADING, "platform.draught"),
        )
    )
    found = next(each for each in document.head if isinstance(each, Table))
    assert [row.cells[0] for row in found.rows] == ["platform draught 35 m", "platform draught 38 m"]
    column = found.headings.index("Largest surge in 3 h, m") - 1
    values = [float(row.cells[column].text) for row in found.rows]  # type: ignore[union-attr]
    assert values == pytest.approx([surge(8.0, 12.0, 0.0) * MEAN * factor for factor in (1.0, 1.1)], abs=0.05)
    # The settings of a design are said by its number, not again with each case.
    assert cards(document)["Largest surge in 3 h"][1].startswith("case 122, variant 2, time domain: significant")
    assert "draught" not in cards(document)["Largest surge in 3 h"][1]


def test_the_scripts_get_what_the_table_has() -> None:
    given = table()
    found = packed_sweep(sweep(given))
    assert found["count"] == 96
    for name in ("case", "variant", "replicate"):
        assert whole(found[name]) == given.columns[name].tolist()
    assert whole(found["domain"]) == [int(each == "time") for each in given.columns["domain"]]
    for key in found["keys"]:
        values = [key["levels"][number] for number in whole(key["which"])]
        assert values == given.columns[key["name"]].tolist()
    values = {(each["signal"], each["statistic"]): unpacked(each["packed"]) for each in found["values"]}
    half = 0.5 * 9.6 / 65534  # of the range of surge, or less
    np.testing.assert_allclose(
        values[SURGE, "expected_maximum"], given.columns[f"{SURGE}.expected_maximum"], rtol=0, atol=1.1 * half * 2
    )
    both = np.stack([given.columns[f"{TENSION}[{number}].expected_maximum"] for number in (1, 2)])
    np.testing.assert_allclose(values["tendons", "expected_maximum"], 1e-6 * both.max(axis=0), rtol=1e-5)
    lowest = np.stack([given.columns[f"{TENSION}[{number}].minimum"] for number in (1, 2)])
    np.testing.assert_allclose(values["tendons", "minimum"], 1e-6 * lowest.min(axis=0), rtol=1e-4)
    assert {each["name"]: each["unit"] for each in found["signals"]}["tendons"] == "MN"
    assert found["left_out"] == ""


def test_large_whole_numbers_are_exact() -> None:
    numbers = np.array([0, 32767, 32768, 65535, 65536, 10_000_019])
    assert whole(packed_whole(numbers)) == numbers.tolist()


def test_what_has_no_room_is_left_out_and_told() -> None:
    found = packed_sweep(sweep(table()), most_values=96 * 6)
    kept = [(each["signal"], each["statistic"]) for each in found["values"]]
    assert len(kept) == 6
    assert (SURGE, "expected_extreme") in kept
    assert ("tendons", "expected_minimum") in kept
    assert not any(signal.startswith(TENSION) for signal, _ in kept)
    total = len(packed_sweep(sweep(table()))["values"])
    assert found["left_out"].startswith(f"{total - 6} of {total} statistics of signals are left out")


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_rows(count: int) -> None:
    document = sweep_document(table(change=only(count), planned=96))
    assert not document.complete
    assert [each.anchor for each in document.sections if each.blocks] == (
        ["parallel", "worst", "settings"] if count else ["settings"]
    )
    page(document)


def test_where_all_failed_nothing_is_drawn() -> None:
    def all_fail(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            fail(row, "no")

    document = sweep_document(table(change=all_fail))
    assert [each.anchor for each in document.sections if each.blocks] == ["failed", "settings"]
    assert "window.tlpsimSweep =" not in page(document)


def charts(parts: tuple[Block, ...]) -> list[str]:
    found = [each.kind for each in parts if isinstance(each, Chart)]
    nested = [each.blocks for each in parts if isinstance(each, Grid | Fold)]
    return [*found, *(kind for each in nested for kind in charts(each))]


def test_figures_are_those_that_the_table_can_fill() -> None:
    def figures(**options: Any) -> list[str]:
        document = sweep_document(table(**options))
        return charts(tuple(block for each in document.sections for block in each.blocks))

    every = ["sweep_cells", "sweep_scatter", "sweep_parallel", "sweep_domains", "sweep_worst"]
    assert figures() == every
    assert figures(domains=("time",)) == [kind for kind in every if kind != "sweep_domains"]
    assert figures(keys=(HEIGHT,)) == [kind for kind in every if kind != "sweep_cells"]


def test_a_page_holds_only_the_scripts_that_it_needs() -> None:
    made = page(sweep_document(table(domains=("time",))))
    assert "window.tlpsimCells =" in made
    assert "window.tlpsimDomains =" not in made
    assert "window.tlpsimSeries =" not in made
    assert "uPlot.iife" not in made
    assert "var uPlot=" not in made
    policy = re.search(r"script-src ([^;]*)", made)
    assert policy
    assert policy[1].count("sha256-") == made.count("<script>")


def test_texts_of_a_sweep_are_escaped() -> None:
    bad = "</script><img src=x onerror=alert(1)>"

    def evil(rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row.update({"file": bad, "name": bad, "waves.spectrum": bad + row["domain"]})
        fail(rows[0], bad)

    made = page(sweep_document(table(change=evil, title=bad, keys=(HEIGHT, "waves.spectrum"), notes=(bad,))))
    assert bad not in made
    data = json.loads(made.split('id="data">')[1].split("</script>")[0])
    (content,) = [each for each in data["contents"] if "files" in each]
    assert content["files"][1] == bad
