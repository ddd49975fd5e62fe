import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.wind.force import mean_force
from tlpsim.loads.wind.segments import Boxes, Segments, default_segments, projected_breadth, projected_segments


def deck(**changes: object) -> Boxes:
    columns = {
        "position": np.array([[5.0, -8.0, 40.0], [0.0, 0.0, 10.0]]),
        "size": np.array([[90.0, 60.0, 12.0], [17.0, 17.0, 20.0]]),
        "shape_coefficient": np.array([1.2, 0.7]),
    }
    return Boxes(**(columns | changes))  # type: ignore[arg-type]


@given(heading=st.floats(-10.0, 10.0), length=st.floats(1.0, 200.0), width=st.floats(1.0, 200.0))
@settings(max_examples=60, deadline=None)
def test_breadth_is_that_of_the_projected_corners(heading: float, length: float, width: float) -> None:
    corners = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    shadow = corners @ np.array([-np.sin(heading), np.cos(heading)])
    breadth = projected_breadth(np.array([[length, width, 1.0]]), heading)[0]
    assert breadth == pytest.approx(shadow.max() - shadow.min(), rel=1e-12)


def test_projected_area_averaged_over_headings_is_cauchys() -> None:
    # Cauchy: the mean breadth of a convex plane figure over all directions is its perimeter / pi.
    size = np.array([[90.0, 60.0, 12.0]])
    corners = 0.5 * np.array([[90.0, 60.0], [-90.0, 60.0], [-90.0, -60.0], [90.0, -60.0]])
    perimeter = ConvexHull(corners).area
    headings = (np.arange(3600) + 0.5) * 2.0 * np.pi / 3600
    mean = np.mean([projected_breadth(size, heading)[0] for heading in headings])
    assert mean == pytest.approx(perimeter / np.pi, rel=1e-6)


@pytest.mark.parametrize("heading", [0.0, 0.6, np.pi / 2, 2.5, -1.2])
def test_pieces_keep_area_centre_and_plane_of_each_box(heading: float) -> None:
    boxes = deck()
    segments = projected_segments(boxes, heading)
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    for number, coefficient in enumerate(boxes.shape_coefficient):
        mine = segments.shape_coefficient == coefficient
        breadth, height = projected_breadth(boxes.size, heading)[number], boxes.size[number, 2]
        area = segments.area[mine]
        assert area.sum() == pytest.approx(breadth * height)
        np.testing.assert_array_equal(segments.plan[mine], np.tile(boxes.size[number, :2], (mine.sum(), 1)))
        centre = area @ segments.position[mine] / area.sum()
        np.testing.assert_allclose(centre, boxes.position[number], atol=1e-9)
        offset = segments.position[mine] - boxes.position[number]
        np.testing.assert_allclose(offset @ along, 0.0, atol=1e-9)
        columns = len(np.unique(np.round(offset @ across, 6)))
        assert columns == int(np.ceil(breadth / 30.0))
        assert np.abs(offset @ across).max() == pytest.approx(0.5 * breadth * (1.0 - 1.0 / columns), abs=1e-9)


def test_a_square_deck_shows_root_two_more_from_the_corner() -> None:
    square = deck(position=[[0.0, 0.0, 40.0]], size=[[80.0, 80.0, 10.0]], shape_coefficient=[1.2])
    side = projected_segments(square, 0.0).area.sum()
    assert side == pytest.approx(800.0)
    assert projected_segments(square, np.pi / 4).area.sum() == pytest.approx(800.0 * np.sqrt(2.0))


def test_uniform_wind_on_a_box_pushes_at_its_centre() -> None:
    boxes = deck(position=[[5.0, -8.0, 40.0]], size=[[90.0, 60.0, 12.0]], shape_coefficient=[1.2])
    for heading in (0.0, 0.9, 4.0):
        segments = projected_segments(boxes, heading)
        count = len(segments.area)
        force = mean_force(segments, np.full(count, 20.0), np.zeros(count), heading, air_density=1.2)
        breadth = 90.0 * abs(np.sin(heading)) + 60.0 * abs(np.cos(heading))
        expected = 0.6 * 1.2 * breadth * 12.0 * 400.0 * np.array([np.cos(heading), np.sin(heading), 0.0])
        np.testing.assert_allclose(force[:3], expected, atol=1e-6)
        np.testing.assert_allclose(force[3:], np.cross([5.0, -8.0, 40.0], expected), atol=1e-4)


@pytest.mark.parametrize("heading", [0.0, 0.4, 2.0, -2.9])
def test_default_segments_stand_across_any_wind(heading: float) -> None:
    segments = default_segments(heading)
    assert segments.area.sum() == pytest.approx(3000.0)
    np.testing.assert_allclose(segments.position @ [np.cos(heading), np.sin(heading), 0.0], 0.0, atol=1e-12)
    assert not segments.plan.any()
    force = mean_force(segments, np.full(6, 25.0), np.zeros(6), heading)
    # Equal forces at one speed act 12 m to the right of the centre.
    assert force[5] == pytest.approx(12.0 * np.hypot(force[0], force[1]), rel=1e-12)


def test_bad_input_is_refused() -> None:
    with pytest.raises(ScenarioError, match="must have the shapes"):
        Segments(position=np.zeros((2, 3)), area=np.ones(3), shape_coefficient=np.ones(3))
    with pytest.raises(ScenarioError, match="must have the shapes"):
        Segments(position=np.zeros((0, 3)), area=np.zeros(0), shape_coefficient=np.zeros(0))
    with pytest.raises(ScenarioError, match="height of a wind segment"):
        Segments(position=np.zeros((1, 3)), area=np.ones(1), shape_coefficient=np.ones(1))
    with pytest.raises(ScenarioError, match="a position is not finite"):
        Segments(position=np.full((1, 3), np.nan), area=np.ones(1), shape_coefficient=np.ones(1))
    with pytest.raises(ScenarioError, match="area of a wind segment"):
        Segments(position=np.array([[0.0, 0.0, 9.0]]), area=-np.ones(1), shape_coefficient=np.ones(1))
    for plan in ([[90.0, 0.0]], [[-1.0, 60.0]], [[np.inf, 60.0]], [[0.0, np.nan]]):
        with pytest.raises(ScenarioError, match=r"plan of wind segment 1 is .* must both be finite and > 0, or both 0"):
            Segments(position=[[0.0, 0.0, 9.0]], area=[1.0], shape_coefficient=[1.0], plan=plan)  # type: ignore[arg-type]
    with pytest.raises(ScenarioError, match=r"plan \(2, 2\) must have the shapes"):
        Segments(position=np.ones((1, 3)), area=np.ones(1), shape_coefficient=np.ones(1), plan=np.ones((2, 2)))
    with pytest.raises(ScenarioError, match="wind boxes: position"):
        deck(size=np.ones((1, 3)))
    with pytest.raises(ScenarioError, match="size of a wind box"):
        deck(size=np.array([[90.0, 60.0, 0.0], [1.0, 1.0, 1.0]]))
    with pytest.raises(ScenarioError, match=r"reaches down to z = -0.5 m"):
        deck(position=np.array([[0.0, 0.0, 40.0], [0.0, 0.0, 9.5]]))
    with pytest.raises(ScenarioError, match="largest piece"):
        projected_segments(deck(), 0.0, largest_piece=0.0)
