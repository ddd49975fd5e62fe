"""The parts of a platform above water on which the wind acts, given one by one or projected from boxes.

A box of length l along the platform's x axis, width w along its y axis and height h shows the wind of heading beta

    A(beta) = h b,   b = l |sin beta| + w |cos beta|                                                 (1)

and is replaced by equal rectangles in the plane across the wind through the box's centre. One box does not shelter
another. The yaw of the platform, which turns the segments' positions, is taken to be too small to change eq. (1).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

LARGEST_PIECE = 30.0  # m, about the size of the gusts that still differ in what a platform feels


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Parts of the platform above water on which the wind acts.

    Parameters
    ----------
    position
        Centroids relative to the reference point at zero yaw, shape (n, 3), m; z is the height above mean water
        level.
    area
        Projected areas, shape (n,), m².
    shape_coefficient
        C, shape (n,).

    Raises
    ------
    ScenarioError
        If shapes do not fit, or a height, an area or a coefficient is not positive.
    """

    position: FloatArray
    area: FloatArray
    shape_coefficient: FloatArray

    def __post_init__(self) -> None:
        _fix_arrays(self, ("position", "area", "shape_coefficient"))
        count = self.area.size
        if count == 0 or self.position.shape != (count, 3) or not self._columns_have_shape((count,)):
            raise ScenarioError(
                f"wind segments: position {self.position.shape}, area {self.area.shape} and shape coefficient "
                f"{self.shape_coefficient.shape} must have the shapes (n, 3), (n,), (n,) with n >= 1"
            )
        if not np.all(np.isfinite(self.position)):
            raise ScenarioError("wind segments: a position is not finite")
        require_positive("height of a wind segment", self.position[:, 2], "m")
        require_positive("area of a wind segment", self.area, "m²")
        require_positive("shape coefficient of a wind segment", self.shape_coefficient, "")

    def _columns_have_shape(self, shape: tuple[int]) -> bool:
        return self.area.shape == shape and self.shape_coefficient.shape == shape


@dataclass(frozen=True, slots=True, kw_only=True)
class Boxes:
    """Upright boxes of which the deck, its modules and the columns above water are made up.

    Parameters
    ----------
    position
        Centres relative to the reference point at zero yaw, shape (n, 3), m; z is the height above mean water level.
    size
        Length along x, width along y and height, shape (n, 3), m.
    shape_coefficient
        C, shape (n,).

    Raises
    ------
    ScenarioError
        If shapes do not fit, a size or a coefficient is not positive, or a box reaches below the water.
    """

    position: FloatArray
    size: FloatArray
    shape_coefficient: FloatArray

    def __post_init__(self) -> None:
        _fix_arrays(self, ("position", "size", "shape_coefficient"))
        count = self.shape_coefficient.size
        shapes = (self.position.shape, self.size.shape, self.shape_coefficient.shape)
        if count == 0 or shapes != ((count, 3), (count, 3), (count,)):
            raise ScenarioError(
                f"wind boxes: position {shapes[0]}, size {shapes[1]} and shape coefficient {shapes[2]} must have the "
                "shapes (n, 3), (n, 3), (n,) with n >= 1"
            )
        if not np.all(np.isfinite(self.position)):
            raise ScenarioError("wind boxes: a position is not finite")
        require_positive("size of a wind box", self.size, "m")
        require_positive("shape coefficient of a wind box", self.shape_coefficient, "")
        lowest = float(np.min(self.position[:, 2] - 0.5 * self.size[:, 2]))
        # A box that stands on the water, written in decimal numbers, may come out a rounding error below it.
        if lowest < -1e-9:
            raise ScenarioError(
                f"wind boxes: a box reaches down to z = {lowest:g} m; it must not reach below the water, z = 0"
            )


def _fix_arrays(record: object, names: tuple[str, ...]) -> None:
    for name in names:
        value = np.array(getattr(record, name), dtype=np.float64)
        value.flags.writeable = False
        object.__setattr__(record, name, value)


def projected_breadth(size: FloatArray, heading: float) -> FloatArray:
    """Breadth across the wind, b of eq. (1), shape (n,), m, of boxes of `size` (n, 3); `heading` in rad."""
    return np.asarray(size[:, 0] * abs(np.sin(heading)) + size[:, 1] * abs(np.cos(heading)))


def projected_segments(boxes: Boxes, heading: float, largest_piece: float = LARGEST_PIECE) -> Segments:
    """Segments that boxes show to the wind, eq. (1).

    Parameters
    ----------
    boxes
        What stands in the wind.
    heading
        Direction toward which the wind blows, rad.
    largest_piece
        A projected box is cut into equal rectangles no broader and no higher than this, m.

    Raises
    ------
    ScenarioError
        If the largest piece is not positive.
    """
    require_positive("largest piece of a wind box", largest_piece, "m")
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    positions, areas, coefficients = [], [], []
    for centre, size, breadth, coefficient in zip(
        boxes.position, boxes.size, projected_breadth(boxes.size, heading), boxes.shape_coefficient, strict=True
    ):
        columns, levels = (int(np.ceil(extent / largest_piece * (1.0 - 1e-12))) for extent in (breadth, size[2]))
        offsets, heights = ((np.arange(count) + 0.5) / count - 0.5 for count in (columns, levels))
        for height in heights:
            for offset in offsets:
                positions.append(centre + offset * breadth * across + height * size[2] * up)
        areas += [breadth * size[2] / (columns * levels)] * (columns * levels)
        coefficients += [coefficient] * (columns * levels)
    return Segments(position=np.array(positions), area=np.array(areas), shape_coefficient=np.array(coefficients))


def default_segments(heading: float) -> Segments:
    """Six equal segments for a large platform: 3000 m² in all, C = 1.2, at heights of 30 and 50 m.

    They stand across the wind, whatever its heading (rad), at -30, 0 and 30 m from a centre that lies 12 m off the
    platform's, to the right of the wind, so that the mean wind turns the platform (positive yaw).
    """
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    offsets = np.array([-30.0, 0.0, 30.0]) - 12.0
    position = np.vstack([offsets[:, None] * across + np.array([0.0, 0.0, height]) for height in (30.0, 50.0)])
    return Segments(position=position, area=np.full(6, 500.0), shape_coefficient=np.full(6, 1.2))
