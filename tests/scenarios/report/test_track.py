import dataclasses
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.scenarios.report.analysis import Analysis
from tlpsim.scenarios.report.cases import cases
from tlpsim.scenarios.report.document import Drawing, Grid
from tlpsim.scenarios.report.track import QUANTILE, ellipse, track_blocks
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.schema import Scenario

SURGE, SWAY = "platform.position.surge", "platform.position.sway"


def test_the_ellipse_is_a_contour_of_the_gaussian_density() -> None:
    mean, covariance = np.array([6.0, -2.0]), np.array([[1.8, 0.9], [0.9, 0.7]])
    points = ellipse(mean, covariance) - mean[:, None]
    squares = np.einsum("in,ij,jn->n", points, np.linalg.inv(covariance), points)
    np.testing.assert_allclose(squares, QUANTILE)
    assert pytest.approx(chi2.ppf(0.95, 2), rel=1e-4) == QUANTILE


@pytest.fixture
def moving(written: Callable[..., Results], storm: Scenario) -> Analysis:
    position = np.random.default_rng(2).multivariate_normal([6.0, 5.0], [[1.8, 0.9], [0.9, 0.7]], 900).T
    results = written({SURGE: position[0], SWAY: position[1]}, {SURGE: "m", SWAY: "m"}, storm)
    (case,) = cases([results])
    return Analysis(case=case, start=0.0, statistics={}, without_statistics="", response=None, without_response="")


def parts(drawing: Drawing, kind: str) -> list[ElementTree.Element]:
    return [each for each in ElementTree.fromstring(drawing.svg).iter() if each.get("class", "").startswith(kind)]


def points(path: ElementTree.Element) -> np.ndarray:
    return np.array([pair.split() for pair in path.get("d", "")[1:].rstrip("Z").split("L")], dtype=float)


def test_scales_are_equal_and_the_path_is_whole(moving: Analysis) -> None:
    (block,) = track_blocks([moving])
    assert isinstance(block, Grid)
    track, compass = block.blocks
    assert isinstance(track, Drawing)
    (path,) = parts(track, "path")
    drawn = points(path)
    surge, sway = (moving.case.results[0].signal(name) for name in (SURGE, SWAY))
    assert len(drawn) == 900
    # The drawing's y goes down; one scale for both.
    scale = np.polyfit(surge, drawn[:, 0], 1)[0]
    np.testing.assert_allclose(np.polyfit(sway, -drawn[:, 1], 1)[0], scale, rtol=1e-3)
    assert isinstance(compass, Drawing)
    assert {each.get("class", "").split()[-1] for each in parts(compass, "arrow")} == {"wind", "waves", "current"}
    assert "wind 26.9 m/s, toward 34.5°" in compass.caption.lower()


def test_arrows_point_where_things_go(moving: Analysis) -> None:
    case = moving.case
    assert case.scenario is not None
    for heading, direction in ((0.0, (1, 0)), (90.0, (0, -1)), (225.0, (-1, 1))):
        scenario = case.scenario.with_(
            wind={"heading_deg": heading}, waves={"significant_height": 0.0}, current={"speed": 0.0}
        )
        (block,) = track_blocks([dataclasses.replace(moving, case=dataclasses.replace(case, scenario=scenario))])
        assert isinstance(block, Grid)
        compass = block.blocks[1]
        assert isinstance(compass, Drawing)
        line = points(parts(compass, "arrow wind")[0])
        assert tuple(np.sign(np.round(line[1] - line[0], 3))) == direction


def test_the_frequency_domain_has_an_ellipse_of_its_own(
    moving: Analysis, fake_response: Callable[..., SpectralResponse]
) -> None:
    (block,) = track_blocks([dataclasses.replace(moving, response=fake_response())])
    assert isinstance(block, Grid)
    assert isinstance(block.blocks[0], Drawing)
    assert len(parts(block.blocks[0], "mark expected")) == 1


def test_nothing_without_a_position(written: Callable[..., Results]) -> None:
    (case,) = cases([written({"a.y": np.arange(9.0)})])
    bare = Analysis(case=case, start=0.0, statistics={}, without_statistics="", response=None, without_response="")
    assert track_blocks([bare]) == []
