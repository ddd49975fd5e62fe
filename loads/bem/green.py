"""The free-surface Green function of a pulsating source, in deep water and in water of constant depth.

    deep     G = 1/r + 1/r1 + K g(K R, K (z + zeta))             (see green_deep)
    finite   G = 1/r + 1/r1 + 1/r2 + g(R, z, zeta)               (see green_finite)

    r  = sqrt(R² + (z - zeta)²)             distance to the source
    r1 = sqrt(R² + (z + zeta)²)             distance to its image in the free surface
    r2 = sqrt(R² + (z + zeta + 2 depth)²)   distance to its image in the bottom

R is the horizontal distance of the field point (at z) from the source (at zeta), both z <= 0 and zeta <= 0, and
K = omega²/gravity whatever the depth. Complex amplitudes vary as exp(+i omega t), so that G ~ exp(-i k R) far out. G is
harmonic in the water but for the source, and satisfies

    dG/dz = K G on z = 0,   dG/dz = 0 on z = -depth,   G(R, z, zeta) = G(R, zeta, z).

The functions below hold all of G but the Rankine terms 1/r, 1/r1, 1/r2, which are integrated over panels in closed
form. They are compiled, take one pair of points a call and allocate nothing, so that kernels may inline them. At the
free surface both keep a logarithm, -2 K ln(K (r1 - z - zeta)/2), integrable over a panel of a lid.
"""

from tlpsim.loads.bem.green_deep import DeepTable, deep_table, deep_wave
from tlpsim.loads.bem.green_finite import FiniteTable, bottom_wave, deep_part, finite_table, finite_wave, no_bottom

__all__ = [
    "DeepTable",
    "FiniteTable",
    "bottom_wave",
    "deep_part",
    "deep_table",
    "deep_wave",
    "finite_table",
    "finite_wave",
    "no_bottom",
]
