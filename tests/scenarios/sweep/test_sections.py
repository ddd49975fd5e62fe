"""What a sweep's file may say, in which spellings, and how each mistake in it is told."""

import tomllib
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.sweep.sections import Linked, Range, SweepFile, Uniform, Values, key_path

SCATTER = "[scatter]\nheights = [1, 2]\nperiods = [5]\noccurrences = [[1], [3]]\n"
SAMPLES = "[latin_hypercube]\nsamples = 3\n"
TIME = 'domains = ["frequency", "time"]\n'
BOTH = ("heights, periods and occurrences", "give either")

REFUSED = {
    # The file itself
    "unknown section": ("grd.x = [1]", ("grd", "did you mean 'grid'?", "replicates, time, statistics")),
    "title": ("title = 3", ("title = 3", "text in quotes")),
    "scenario": ("scenario = 3", ("scenario = 3", "text in quotes")),
    "no such scenario": ('scenario = "none.toml"', ("none.toml", "no such scenario file")),
    "domain": ('domains = ["time", "freq"]', ('domains[1] = "freq"', "'frequency' or 'time'")),
    "no domain": ("domains = []", ("domains = []", "1 or more")),
    "files": ('files = ["hdf5"]', ('files[0] = "hdf5"', "'frequency' or 'time'")),
    "set": ("set = 3", ("set = 3", "a table of keys")),
    "set key": ("[set]\nwaves.hight = 3", ("set: waves.hight", "unknown key", "significant_height")),
    # Grid
    "grid list": ("grid = [1]", ("grid = [1]", "table of keys")),
    "grid number": ("[grid]\nwaves.heading_deg = 3", ('grid."waves.heading_deg" = 3', "a list", "{ from, to, count }")),
    "grid text": ('[grid]\nwaves.spectrum = "jonswap"', ("waves.spectrum", "a list")),
    "grid empty": ("[grid]\nwaves.heading_deg = []", ("waves.heading_deg", "values = []", "1 or more")),
    "grid empty table": ("[grid]\nwaves = {}", ("grid.waves = {}", "is missing")),
    "grid of tables": ("[grid]\nplatform.tendons = [{ diameter = 1 }]", ("values[0]", "number, text, true, false or")),
    "grid of dates": ("[grid]\nwaves.heading_deg = [2020-01-01]", ("values[0]", "number, text, true, false or a list")),
    "key with a space": ('[grid]\n"waves height" = [1]', ("'waves height' is no key", "waves.heading_deg")),
    "key that ends with a dot": ('[grid]\n"waves." = [1]', ("'waves.' is no key",)),
    "empty key": ('[grid]\n"" = [1]', ("'' is no key",)),
    "key of two lines": ('[grid]\n"a = 1\\nb" = [1]', ("is no key",)),
    "key twice": ('[grid]\n"waves.heading_deg" = [1]\nwaves.heading_deg = [2]', ("waves.heading_deg is there twice",)),
    "count 1": ("[grid]\nwind.speed = { from = 1, to = 2, count = 1 }", ("wind.speed", "count = 1", "at least 2")),
    "count 2.5": ("[grid]\nwind.speed = { from = 1, to = 2, count = 2.5 }", ("count = 2.5", "whole number")),
    "no count": ("[grid]\nwind.speed = { from = 1, to = 2 }", ("wind.speed", "count: is missing")),
    "from text": ('[grid]\nwind.speed = { from = "1", to = 2, count = 3 }', ('from = "1"', "must be a finite number")),
    "from true": (
        "[grid]\nwind.speed = { from = true, to = 2, count = 3 }",
        ("from = true", "must be a finite number"),
    ),
    "from nan": ("[grid]\nwind.speed = { from = nan, to = 2, count = 3 }", ("from = NaN", "must be a finite number")),
    "to without end": (
        f"[grid]\nwind.speed = {{ from = 1, to = 1{'0' * 400}, count = 3 }}",
        ("must be a finite number",),
    ),
    "step": (
        "[grid]\nwind.speed = { from = 1, to = 2, step = 1 }",
        ("wind.speed", "step: unknown key", "from, to, count"),
    ),
    "form": ("[grid]\nwind.speed = { form = 1, to = 2, count = 3 }", ("form: unknown key (did you mean 'from'?)",)),
    # Probabilities
    "too few": ("[grid]\nwind.speed = { values = [1, 2], probability = [0.5] }", ("[0.5]", "one number for each of 2")),
    "above 1": (
        "[grid]\nwind.speed = { values = [1, 2], probability = [0.7, 0.7] }",
        ("add up to 1 at most", "not to 1.4"),
    ),
    "below 0": (
        "[grid]\nwind.speed = { values = [1, 2], probability = [-1, 1] }",
        ("probability[0] = -1", "at least 0"),
    ),
    "all 0": ("[grid]\nwind.speed = { values = [1, 2], probability = [0, 0] }", ("more than 0", "not to 0")),
    "text": ('[grid]\nwind.speed = { values = [1, 2], probability = ["a", 1] }', ('probability[0] = "a"', "a number")),
    "nan": ("[grid]\nwind.speed = { values = [1, 2], probability = [nan, 1] }", ("probability[0] = NaN", "finite")),
    # Scatter
    "scatter list": ("scatter = [1]", ("scatter = [1]", "table of keys")),
    "scatter of nothing": ("[scatter]\nperiod_factor = 1.2", BOTH),
    "scatter of both": ('[scatter]\nfile = "a.csv"\nheights = [1]', BOTH),
    "scatter key": ("[scatter]\nfle = 1", ("scatter.fle", "did you mean 'file'?")),
    "scatter file": ("[scatter]\nfile = 1", ("scatter.file = 1", "text in quotes")),
    "rows": ("[scatter]\nheights = [1, 2]\nperiods = [5]\noccurrences = [[1]]", ("a row for each of 2 heights",)),
    "ragged": (
        "[scatter]\nheights = [1, 2]\nperiods = [5]\noccurrences = [[1], [1, 2]]",
        ("1 numbers for the periods",),
    ),
    "negative": (
        "[scatter]\nheights = [1]\nperiods = [5]\noccurrences = [[-1]]",
        ("occurrences = [[-1]]", "0 or more"),
    ),
    "text in scatter": (
        '[scatter]\nheights = ["1"]\nperiods = [5]\noccurrences = [[1]]',
        ("heights[0]", "finite number"),
    ),
    "infinite": (
        "[scatter]\nheights = [1]\nperiods = [5]\noccurrences = [[inf]]",
        ("occurrences[0][0] = Infinity", "finite number"),
    ),
    "all cells 0": ("[scatter]\nheights = [1]\nperiods = [5]\noccurrences = [[0]]", ("add up to 0", "more than 0")),
    "total": (f"{SCATTER}total = 3", ("add up to 4", "total is 3", "to the total at most")),
    "total infinite": (f"{SCATTER}total = inf", ("scatter.total", "finite number")),
    "least": (f"{SCATTER}least_probability = 0.8", ("no cell", "0.8 (least_probability)")),
    "least below 0": (f"{SCATTER}least_probability = -0.1", ("least_probability = -0.1", "at least 0")),
    "factor": (f"{SCATTER}period_factor = 0", ("period_factor = 0", "greater than 0")),
    "height key": (f'{SCATTER}height_key = "waves height"', ("'waves height' is no key",)),
    "one key": (f'{SCATTER}height_key = "waves.peak_period"', ("'waves.peak_period' varies in two places",)),
    # Latin hypercube
    "0 samples": (
        "[latin_hypercube]\nsamples = 0\nkeys.wind.speed = [1]",
        ("latin_hypercube.samples = 0", "at least 1"),
    ),
    "no keys": (SAMPLES, ("latin_hypercube.keys: is missing",)),
    "empty keys": (f"{SAMPLES}keys = {{}}", ("latin_hypercube.keys = {}", "1 or more")),
    "falling": (f"{SAMPLES}keys.wind.speed = {{ from = 3, to = 2 }}", ("wind.speed", "to = 2", "above 'from', 3")),
    "std 0": (f"{SAMPLES}keys.wind.speed = {{ mean = 3, std = 0 }}", ("std = 0", "greater than 0")),
    "no std": (f"{SAMPLES}keys.wind.speed = {{ mean = 3 }}", ("std: is missing",)),
    "number": (
        f"{SAMPLES}keys.wind.speed = 3",
        ("wind.speed", "{ from, to } or { mean, std } or { values, probability }"),
    ),
    "range": (f"{SAMPLES}keys.wind.speed = {{ from = 1, to = 2, count = 3 }}", ("count: unknown key",)),
    "sample seed": ("[latin_hypercube]\nsamples = 1\nseed = -1\nkeys.wind.speed = [1]", ("seed = -1", "at least 0")),
    # Linked
    "linked number": ("[linked]\nwind.speed = 3", ("wind.speed", "table of keys")),
    "linked nothing": ("[linked]\nwind.speed = {}", ("wind.speed", "by: is missing")),
    "linked without by": ("[linked]\nwind.speed = { plus = 3 }", ("wind.speed", "by: is missing")),
    "linked by no key": ('[linked]\nwind.speed = { by = "waves height" }', ("'waves height' is no key",)),
    "linked falls": (
        '[linked]\nwind.speed = { by = "a", at = [2, 1], value = [1, 2] }',
        ("at = [2.0, 1.0]", "must rise"),
    ),
    "linked nan": ('[linked]\nwind.speed = { by = "a", at = [1, nan], value = [1, 2] }', ("at[1] = NaN", "finite")),
    "linked short": ('[linked]\nwind.speed = { by = "a", at = [1, 2], value = [1] }', ("as many numbers as 'at', 2",)),
    "linked point": ('[linked]\nwind.speed = { by = "a", at = [1], value = [1] }', ("two or more or none",)),
    # Records, domains, statistics
    "no records": (f"{TIME}[replicates]\nrecords = 0", ("replicates.records = 0", "at least 1")),
    "too many records": (f"{TIME}[replicates]\nrecords = 1000000", ("records = 1000000", "at most 100000")),
    "large seed": (f"{TIME}[replicates]\nseed = 99999999999", ("replicates.seed", "at most 2147483647")),
    "records without time": (
        "[replicates]\nrecords = 3",
        ("records = 3", "only the time domain", '["frequency", "time"]'),
    ),
    "worst 0": (f"{TIME}[time]\nworst = 0", ("time.worst = 0", "at least 1")),
    "worst without time": ("[time]\nworst = 3", ("time.worst = 3", 'domains = ["frequency", "time"]')),
    "worst without frequency": (
        'domains = ["time"]\n[time]\nworst = 3',
        ("time.worst = 3", "which cases are the worst"),
    ),
    "engine": ('[time]\nengine = "fast"', ("time.engine", "'cosimulation' or 'monolithic'")),
    "by": ("[time]\nby = 3", ("time.by = 3", "text in quotes")),
    "no signals": ("[statistics]\nsignals = []", ("statistics.signals", "1 or more")),
    "signals text": ('[statistics]\nsignals = "x"', ("statistics.signals", "square brackets")),
    "exposure": ("[statistics]\nexposure = 0", ("statistics.exposure = 0", "greater than 0")),
    "exposure unit": ('[statistics]\nexposure = "3 hours"', ("'hours' is not a unit of time", "'h'")),
    "slope": ("[statistics]\nslope = -1", ("statistics.slope = -1", "greater than 0")),
    "year 0": ("[long_term]\nyears = [0]", ("long_term.years[0] = 0", "greater than 0")),
    "year infinite": ("[long_term]\nyears = [1, inf]", ("long_term.years[1]", "finite number")),
    "year within a sea state": (
        "[long_term]\nyears = [1, 1e-4]",
        ("years[1] = 0.0001", "statistics.exposure = 10800 s"),
    ),
    "no years": ("[long_term]\nyears = []", ("long_term.years = []", "1 or more")),
    "years": ("[long_term]\nyears = 100", ("long_term.years = 100", "square brackets")),
    "life": ("[long_term]\nlife = 0", ("long_term.life = 0", "greater than 0")),
    "curve without area": ("[long_term]\nlog10_a = 12", ("long_term.area", "goes with log10_a")),
    "area without curve": ("[long_term]\narea = 0.1", ("long_term.area = 0.1", "goes with log10_a")),
    # Cases
    "cases number": ("cases = 3", ("cases = 3", "square brackets")),
    "cases of numbers": ("cases = [3]", ("cases[0] = 3", "table of keys")),
    "case name": ("[[cases]]\nname = 3", ("cases[0].name = 3", "text in quotes")),
    "case key": ('[[cases]]\n"waves height" = 3', ("'waves height' is no key",)),
    "case probability": ('[[cases]]\nprobability = "x"', ('cases[0].probability = "x"', "a number")),
    "some probabilities": (
        "[[cases]]\nprobability = 0.1\n[[cases]]\nname = 'b'",
        ("to all cases of the list, or to none",),
    ),
    "many probabilities": ("[[cases]]\nprobability = 0.6\n[[cases]]\nprobability = 0.6", ("cases", "not to 1.2")),
}


@pytest.mark.parametrize(("text", "wanted"), REFUSED.values(), ids=REFUSED)
def test_mistakes_are_told_in_one_line(text: str, wanted: tuple[str, ...], refusal: Callable[..., str]) -> None:
    message = refusal(text)
    for each in wanted:
        assert each in message
    assert "sweep.toml" in message or "none.toml" in message


def read(text: str) -> SweepFile:
    return SweepFile.read(tomllib.loads(text), "sweep.toml")


@pytest.mark.parametrize(
    "text",
    [
        "[grid]\nwaves.heading_deg = [0, 45]",
        "[grid.waves]\nheading_deg = [0, 45]",
        '[grid]\n"waves.heading_deg" = [0, 45]',
        "[grid]\nwaves = { heading_deg = [0, 45] }",
        "[grid]\nwaves.heading_deg = { values = [0, 45] }",
        "[grid.waves.heading_deg]\nvalues = [0, 45]",
    ],
)
def test_a_key_is_dotted_or_in_tables(text: str) -> None:
    assert read(text).grid == {"waves.heading_deg": Values(values=(0, 45))}


def test_kinds_are_told_by_their_keys() -> None:
    file = read(
        "[grid]\nwind.speed = { from = 10, to = 20.0, count = 3 }\n"
        "[latin_hypercube]\nsamples = 2\n[latin_hypercube.keys]\nplatform.mass = { from = 1, to = 2 }\n"
        '[linked]\ncurrent.speed = { by = "wind.speed", plus = 1 }\n'
    )
    assert file.grid == {"wind.speed": Range(first=10.0, last=20.0, count=3)}
    assert file.latin_hypercube is not None
    assert file.latin_hypercube.keys == {"platform.mass": Uniform(low=1.0, high=2.0)}
    assert file.linked == {"current.speed": Linked(by="wind.speed", plus=1.0)}


def test_settings_of_a_case_are_all_keys_but_its_own() -> None:
    (case,) = read('[[cases]]\nname = "a"\nprobability = "20 %"\nwaves.heading_deg = 3\nwind = { speed = 4 }').cases
    assert (case.name, case.probability) == ("a", 0.2)
    assert case.settings == {"waves.heading_deg": 3, "wind.speed": 4}


def test_quantities_have_units() -> None:
    file = read('[statistics]\nexposure = "1 h"')
    assert file.statistics.exposure == 3600.0


def test_an_empty_file_is_the_scenario_in_the_frequency_domain() -> None:
    file = read("")
    assert file.domains == ("frequency",)
    assert file.replicates.records == 1
    assert not file.grid


def test_values_keep_their_kinds() -> None:
    values = read('[grid]\nwaves.splash = [true, 1, 1.0, "1", [1, 2]]').grid["waves.splash"]
    assert isinstance(values, Values)
    assert [type(each) for each in values.values] == [bool, int, float, str, list]


@given(st.lists(st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1), min_size=1, max_size=4))
def test_a_key_splits_as_it_is_joined(parts: list[str]) -> None:
    quoted = [part.replace("\\", "\\\\").replace('"', '\\"') for part in parts]
    assert key_path(".".join(f'"{part}"' for part in quoted)) == tuple(parts)


@given(st.lists(st.from_regex(r"[A-Za-z0-9_.*\[\]-]+", fullmatch=True), min_size=1, max_size=4))
def test_a_dotted_key_splits_again(parts: list[str]) -> None:
    assert key_path(dotted(tuple(parts))) == tuple(parts)
