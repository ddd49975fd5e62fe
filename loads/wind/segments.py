"""The parts of a platform above water on which the wind acts, given one by one or projected from boxes.

A box of length l along the platform's x axis, width w along its y axis and height h shows the wind of heading beta

    A(beta) = h b,   b = l |sin beta| + w |cos beta|                                                 (1)

and is replaced by equal rectangles in the plane across the wind through the box's centre. One box does not shelter
another. At a yaw psi of the platform each rectangle has the area

    A(beta, psi) = A(beta) b(beta - psi) / b(beta)                                                   (2)

so that the box's force is that of the face it then shows. The rectangles turn rigidly with the platform about its
reference point. Their centre stays the box's, and force and moment in a uniform wind are exact at any yaw. Across the
wind they spread over b(beta) cos(psi) in place of b(beta - psi): an error of first order in the yaw in what depends
on that spread, the moment of gusts that differ between the rectangles and the damping of yaw. A segment that comes
from no box keeps its area at any yaw.
"""

from dataclasses import dataclass, field, replace

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
    plan
        Length along the platform's x axis and width along its y axis of the box that a segment is a part of, shape
        (n, 2), m: with yaw its area changes by eq. (2). Zeros, the default, for an area that yaw does not change.

    Raises
    ------
    ScenarioError
        If shapes do not fit, a height, an area or a coefficient is not positive, or one side of a plan is zero.
    """

    position: FloatArray
    area: FloatArray
    shape_coefficient: FloatArray
    plan: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        _fix_arrays(self, ("position", "area", "shape_coefficient", "plan"))
        count = self.area.size
        if self.plan.size == 0:
            object.__setattr__(self, "plan", np.zeros((count, 2)))
            self.plan.flags.writeable = False
        shapes = self.position.shape, self.area.shape, self.shape_coefficient.shape, self.plan.shape
        if count == 0 or shapes != ((count, 3), (count,), (count,), (count, 2)):
            raise ScenarioError(
                f"wind segments: position {shapes[0]}, area {shapes[1]}, shape coefficient {shapes[2]} and plan "
                f"{shapes[3]} must have the shapes (n, 3), (n,), (n,), (n, 2) with n >= 1"
            )
        if not np.all(np.isfinite(self.position)):
            raise ScenarioError("wind segments: a position is not finite")
        require_positive("height of a wind segment", self.position[:, 2], "m")
        require_positive("area of a wind segment", self.area, "m²")
        require_positive("shape coefficient of a wind segment", self.shape_coefficient, "")
        bad = ~(np.all(self.plan == 0.0, axis=1) | np.all((self.plan > 0.0) & np.isfinite(self.plan), axis=1))
        if np.any(bad):
            number = int(np.argmax(bad))
            raise ScenarioError(
                f"plan of wind segment {number + 1} is {self.plan[number, 0]:g} by {self.plan[number, 1]:g} m; length "
                "and width must both be finite and > 0, or both 0 for an area that does not change with yaw"
            )


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
    positions, areas, coefficients, plans = [], [], [], []
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
        plans += [size[:2]] * (columns * levels)
    return Segments(
        position=np.array(positions),
        area=np.array(areas),
        shape_coefficient=np.array(coefficients),
        plan=np.array(plans),
    )


def with_constant_areas(segments: Segments) -> Segments:
    """The same segments, with areas that do not change with yaw."""
    return replace(segments, plan=np.zeros_like(segments.plan))


def default_segments(heading: float) -> Segments:
    """Six equal segments for a large platform: 3000 m² in all, C = 1.2, at heights of 30 and 50 m.

    They stand across the wind, whatever its heading (rad), at -30, 0 and 30 m from a centre that lies 12 m off the
    platform's, to the right of the wind, so that the mean wind turns the platform (positive yaw). As the area is the
    same from all sides, yaw does not change it.
    """
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    offsets = np.array([-30.0, 0.0, 30.0]) - 12.0
    position = np.vstack([offsets[:, None] * across + np.array([0.0, 0.0, height]) for height in (30.0, 50.0)])
    return Segments(position=position, area=np.full(6, 500.0), shape_coefficient=np.full(6, 1.2))
