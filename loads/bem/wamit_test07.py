"""The panels of WAMIT's test 07: the ISSC TLP on which codes are compared, 1012 panels a quadrant.

Coordinates as in the file test07.gdf of WAMIT 7.3 (to its five decimals), written by its pattern: columns of 24 even
sides above mid-draught and of 30 sides below, where they take the pontoons' mouths; all rows clustered by a cosine.
"""

import numpy as np

from tlpsim.loads.bem.hulls import patch
from tlpsim.loads.bem.mesh import Mesh

CENTRE, CORNER = 43.125, 49.09267
UPPER = -17.50013 + 17.50013 * np.cos(np.pi / 16.0 * np.arange(9))
LOWER = np.array([-17.50013, -20.91424, -24.19714, -27.22268, -29.87459, -32.05095, -33.66814, -34.66399, -35.00025])
ABOVE_MOUTH = np.array([-17.50013, -19.59190, -21.54111, -23.21494, -24.49931])
PONTOON = np.array([-24.49931, -25.47329, -27.35702, -29.74978, -32.14254, -34.02627, -35.00025])
# Of the western column side, from the circle's node at 135° to that at 225°.
MOUTH_SIDE = np.array(
    [
        [36.14890, 47.87476],
        [35.56424, 46.87481],
        [35.09415, 45.71954],
        [34.73694, 44.05595],
        [34.73694, 42.19405],
        [35.09415, 40.53047],
        [35.56424, 39.37519],
        [36.14890, 38.37525],
    ]
)
MOUTH = slice(14, 20)  # nodes of the ring in which the pontoon along x ends
ALONG = np.array(
    [35.56424, 34.71369, 33.10054, 30.76023, 27.74418, 24.1224, 19.96324, 15.36929, 10.43770, 5.27681, 0.0]
)
BOTTOM = np.array([35.09415, 35.36779, 36.17008, 37.44633, 39.10957, 41.04646, CENTRE])


def _nodes(line: np.ndarray, heights: np.ndarray) -> np.ndarray:
    return np.stack([np.column_stack([line, np.full(len(line), z)]) for z in heights])


def wamit_test07() -> Mesh:
    """One quadrant, of 53 066.4 m³ in all."""
    angles = np.radians(np.arange(-45.0, 316.0, 15.0))
    radius = np.sqrt(2.0) * (CORNER - CENTRE)
    even = CENTRE + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ring = np.concatenate([even[:13], MOUTH_SIDE, even[18:19], MOUTH_SIDE[::-1, ::-1], even[24:]])
    parts = [patch(_nodes(even, UPPER))]
    for side in range(len(ring) - 1):
        inside = 14 <= side < 19 or 23 <= side < 28
        parts.append(patch(_nodes(ring[side : side + 2], ABOVE_MOUTH if inside else LOWER)))
    inwards = (CENTRE - BOTTOM) / (CENTRE - BOTTOM[0])
    disc = CENTRE + inwards[:, None, None] * (ring - CENTRE)
    parts.append(patch(np.concatenate([disc, np.full((*disc.shape[:2], 1), LOWER[-1])], axis=-1)))
    mouth = ring[MOUTH]
    around = np.concatenate(
        [_nodes(mouth[::-1], PONTOON[:1])[0], _nodes(mouth[:1], PONTOON[1:])[:, 0], _nodes(mouth[1:], PONTOON[-1:])[0]]
    )
    around = np.concatenate([around, _nodes(mouth[-1:], PONTOON[-2::-1])[:, 0]])
    pontoon = patch(np.stack([around * np.array([x / ALONG[0], 1.0, 1.0]) for x in ALONG])[::-1])
    return Mesh(
        name="WAMIT test 07",
        vertices=np.concatenate([*parts, pontoon, pontoon[:, [0, 3, 2, 1]][..., [1, 0, 2]]]),
        planes=("x", "y"),
    )
