"""Reflections of a mesh: the classes into which a system falls apart, and the fourfold symmetry of square platforms.

With m images s and characters chi (m classes), a field f on all images has the components

    f_chi = 1/m Σ_s chi(s) f(s),    f(s) = Σ_chi chi(s) f_chi                                                       (1)

and each class has a system of the stored panels of its own. Where the stored quadrant is its own mirror in the plane
x = y, panel i in panel π i, matrices are stored for one half F of the field panels only, since

    M_chi[π j, π i] = M_chi'[j, i],    chi' = chi with x and y exchanged                                            (2)

so that of a quadrant of n panels, surge and sway share one system of n, and each other class falls apart into an even
and an odd system of n/2: 3/2 n³ in place of 4 n³. All matrices are [source, field].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tlpsim.loads.bem.mesh import Panels

FloatArray = NDArray[np.float64]
IntegerArray = NDArray[np.int64]

CHARACTERS: dict[int, FloatArray] = {
    1: np.array([[1.0]]),
    2: np.array([[1.0, 1.0], [1.0, -1.0]]),
    4: np.array([[1.0, 1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]]),
}
"""Number of images -> characters (classes, images) of the reflections, in the order of `mesh.PLANES`."""

EXCHANGED = np.array([0, 2, 1, 3])
"""Images and classes of two planes after x and y have been exchanged."""
_SURGE, _SWAY = 1, 2  # classes that eq. (2) maps on each other
_ALIKE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """Field panels (m,) for which matrices are stored, and the mirror (n,) of every panel in the plane x = y.

    Without that symmetry the field panels are all panels, and every panel is its own mirror.
    """

    fields: IntegerArray
    mirror: IntegerArray

    @property
    def halved(self) -> bool:
        """Whether the quadrant is its own mirror."""
        return len(self.fields) < len(self.mirror)


def unfolded(count: int) -> Fold:
    """Fold of a mesh without the symmetry x = y."""
    everything = np.arange(count, dtype=np.int64)
    return Fold(fields=everything, mirror=everything)


def find_fold(panels: Panels, moments: FloatArray, images: int) -> Fold:
    """Fourfold symmetry of a quadrant, found by the panels' centres, normals, areas and second moments (n, 6)."""
    count = len(panels.area)
    if images != 4 or count % 2:
        return unfolded(count)
    extent = float(np.max(np.abs(panels.centre)))
    distance, mirror = cKDTree(panels.centre).query(panels.centre[:, [1, 0, 2]])
    pairs = np.all(mirror[mirror] == np.arange(count)) and np.all(mirror != np.arange(count))
    alike = (
        np.max(distance) < _ALIKE * extent
        and np.allclose(panels.area[mirror], panels.area, rtol=_ALIKE)
        and np.allclose(panels.normal[mirror], panels.normal[:, [1, 0, 2]], atol=_ALIKE)
        and np.allclose(moments[mirror], moments[:, [1, 0, 2, 3, 5, 4]], atol=_ALIKE * np.max(moments))
    )
    if not (pairs and alike):
        return unfolded(count)
    return Fold(fields=np.flatnonzero(np.arange(count) < mirror).astype(np.int64), mirror=mirror.astype(np.int64))


def classes(field: NDArray, characters: FloatArray) -> NDArray:
    """Components (classes, panels, ...) of a field (images, panels, ...), eq. (1)."""
    return np.asarray(np.tensordot(characters, field, axes=(1, 0)) / len(characters))


def images_of(components: NDArray, characters: FloatArray) -> NDArray:
    """A field (images, panels, ...) of its components in the classes; the inverse of `classes`."""
    return np.asarray(np.tensordot(characters.T, components, axes=(1, 0)))


def system_panels(fold: Fold, count: int) -> list[IntegerArray]:
    """Panels that are the unknowns of each system of `count` classes."""
    if not fold.halved:
        return [fold.fields] * count
    everything = np.arange(len(fold.mirror), dtype=np.int64)
    return [everything, *[fold.fields] * 4]


def system_matrices(matrices: NDArray, fold: Fold) -> list[NDArray]:
    """Matrices [source, field] of the systems, of matrices (classes, sources, stored fields), eq. (2)."""
    if not fold.halved:
        return list(matrices)
    here, there = fold.fields, fold.mirror[fold.fields]
    both = np.empty((matrices.shape[1], matrices.shape[1]), dtype=matrices.dtype)
    both[:, here] = matrices[_SURGE]
    both[:, there] = matrices[_SWAY][fold.mirror]
    single = [matrices[row][here] + sign * matrices[row][there] for row in (0, 3) for sign in (1.0, -1.0)]
    return [both, *single]


def system_vectors(components: NDArray, fold: Fold) -> list[NDArray]:
    """Columns (panels, columns) of the systems, of components (classes, panels, columns)."""
    if not fold.halved:
        return list(components)
    here, there = fold.fields, fold.mirror[fold.fields]
    both = np.concatenate([components[_SURGE], components[_SWAY][fold.mirror]], axis=1)
    parts = [0.5 * (components[row][here] + sign * components[row][there]) for row in (0, 3) for sign in (1.0, -1.0)]
    return [both, *parts]


def components_of(vectors: Sequence[NDArray], fold: Fold) -> NDArray:
    """Components (classes, panels, columns) of the systems' columns; the inverse of `system_vectors`."""
    if not fold.halved:
        return np.stack(vectors)
    here, there = fold.fields, fold.mirror[fold.fields]
    columns = vectors[1].shape[1]
    result = np.empty((4, len(fold.mirror), columns), dtype=vectors[0].dtype)
    result[_SURGE] = vectors[0][:, :columns]
    result[_SWAY] = vectors[0][fold.mirror, columns:]
    for row, (even, odd) in ((0, vectors[1:3]), (3, vectors[3:5])):
        result[row][here], result[row][there] = even + odd, even - odd
    return result
