"""How well a fitted model meets its spectrum: figures, limits and advice.

Over a band of frequencies, with S the target and T the spectrum of the model,

    auto error     10 lg (T_ii / S_ii)                          in dB, largest and root mean square   (1)
    cross error    |T_ij - S_ij| / sqrt(S_ii S_jj),  i != j                                           (2)
    coherence      | |T_ij| / sqrt(T_ii T_jj) - |S_ij| / sqrt(S_ii S_jj) |                            (3)

at frequencies with equal ratios, so that each decade counts alike.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.filters.model import LARGEST_POLE, ArmaModel, covariance, largest_pole, round_off, spectrum

FloatArray = NDArray[np.float64]
Array = NDArray[np.float64] | NDArray[np.complex128]


class FilterFitWarning(UserWarning):
    """A fitted filter misses its spectrum by more than the limits of its certificate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a fit may miss at most to be trusted; the figures of `Certificate` of the same names.

    Parameters
    ----------
    auto_error_max, auto_error_rms
        dB.
    cross_error_max, coherence_error_max
        Of 1.
    variance_error
        Of 1, either way.
    largest_pole, round_off
        Of 1.
    """

    auto_error_max: float = 1.2
    auto_error_rms: float = 0.35
    cross_error_max: float = 0.3  # as 1.2 dB in a coherent pair
    coherence_error_max: float = 0.1
    variance_error: float = 0.005
    largest_pole: float = LARGEST_POLE
    round_off: float = 1e-4


DEFAULT_LIMITS = Limits()

_TITLES = {
    "auto_error_max": ("largest error of the auto-spectra", "dB"),
    "auto_error_rms": ("root mean square error of the auto-spectra", "dB"),
    "cross_error_max": ("largest error of the cross-spectra", ""),
    "coherence_error_max": ("largest error of the root coherence", ""),
    "variance_error": ("error of the variance below the Nyquist frequency", ""),
    "largest_pole": ("largest pole", ""),
    "round_off": ("noise of rounding", ""),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Figures of one fit.

    Parameters
    ----------
    band
        Lowest and highest frequency of the comparison, Hz.
    level
        Only where an auto-spectrum is above this part of its peak does it count.
    auto_error_max, auto_error_rms
        Eq. (1), dB.
    cross_error_max, cross_error_rms
        Eq. (2); zero for one component.
    coherence_error_max
        Eq. (3); zero for one component.
    density_error
        Root mean square of T_ii - S_ii over that of S_ii, of the worst component.
    largest_pole
        Spectral radius of the model.
    round_off
        Noise that rounding makes, over the standard deviation.
    variance_error
        Largest of |variance of the model / variance of the target below the Nyquist frequency - 1|.
    variance_lost
        Largest part of a target variance that lies above the Nyquist frequency.
    condition_number
        Of the block Toeplitz matrix of the correlations that were matched (of its first 200 rows at most).
    orders_asked, orders_used
        As text, "AR(25) -> ARMA(3, 3)".
    fallback
        Why the orders used are not those asked, else empty.
    rank
        Number of independent components that the model has, at most m.
    white_floor
        White noise added to the target before the match, over its peak.
    ridge
        White noise added to make the correlations positive definite, over the variance.
    limits
        What was held to be good enough.
    advice
        What to do when it is not, else empty.
    """

    band: tuple[float, float]
    level: float
    auto_error_max: float
    auto_error_rms: float
    cross_error_max: float
    cross_error_rms: float
    coherence_error_max: float
    density_error: float
    largest_pole: float
    round_off: float
    variance_error: float
    variance_lost: float
    condition_number: float
    orders_asked: str
    orders_used: str
    fallback: str
    rank: int
    white_floor: float
    ridge: float
    limits: Limits
    advice: str = ""

    @property
    def misses(self) -> tuple[str, ...]:
        """Names of the figures beyond their limits."""
        names = (field.name for field in fields(self.limits))
        return tuple(name for name in names if not getattr(self, name) <= getattr(self.limits, name))

    @property
    def trusted(self) -> bool:
        """Whether all figures are within their limits."""
        return not self.misses

    def table(self) -> str:
        """The figures as text, one a line: name, value, limit."""
        rows = [("orders", self.orders_used, f"asked: {self.orders_asked}")]
        if self.fallback:
            rows.append(("fallback", self.fallback, ""))
        rows.append(("band", f"{self.band[0]:.4g} to {self.band[1]:.4g} Hz", f"where S > {self.level:g} of its peak"))
        for name, (title, unit) in _TITLES.items():
            form = ".6f" if name == "largest_pole" else ".3g"
            limit = f"at most {getattr(self.limits, name):{form}} {unit}".rstrip()
            if name in self.misses:
                limit += "  MISSED"
            rows.append((title, f"{getattr(self, name):{form}} {unit}".rstrip(), limit))
        rows += [
            ("root mean square error of the cross-spectra", f"{self.cross_error_rms:.3g}", ""),
            ("root mean square error of the density", f"{self.density_error:.3g}", "of its root mean square"),
            ("variance above the Nyquist frequency", f"{100.0 * self.variance_lost:.3g} %", "not in the samples"),
            ("condition number", f"{self.condition_number:.2g}", ""),
            ("rank", str(self.rank), ""),
            ("white floor", f"{self.white_floor:g}", "of the peak"),
            ("ridge", f"{self.ridge:g}", "of the variance"),
        ]
        width = [max(len(row[column]) for row in rows) for column in (0, 1)]
        lines = [f"{name:<{width[0]}}  {value:<{width[1]}}  {note}".rstrip() for name, value, note in rows]
        return "\n".join([*lines, self.advice] if self.advice else lines)


def spectral_errors(target: Array, model: Array, frequency: FloatArray, level: float = 0.0) -> dict[str, float]:
    """Figures of eq. (1) to (3) and the error of the density, by the names of `Certificate`.

    Parameters
    ----------
    target, model
        Cross-spectra, shape (nf, m, m).
    frequency
        Of the two, shape (nf,), rising, Hz. All count alike in a root mean square, but for that of the density.
    level
        A component counts where its target is above this part of its peak.
    """
    size = target.shape[1]
    auto, found = (np.real(np.einsum("fii->fi", matrix)) for matrix in (target, model))
    counts = auto > level * np.max(auto, axis=0)
    counts &= auto > 0.0
    ratio = np.where(counts, found, 1.0) / np.where(counts, auto, 1.0)
    error = 10.0 * np.log10(ratio)
    missed, whole = (np.trapezoid(part**2, frequency, axis=0) for part in (found - auto, auto))
    density = np.sqrt(missed / whole)
    result = {
        "auto_error_max": float(np.max(np.abs(error))),
        "auto_error_rms": float(np.sqrt(np.sum(error**2) / max(np.sum(counts), 1))),
        "cross_error_max": 0.0,
        "cross_error_rms": 0.0,
        "coherence_error_max": 0.0,
        "density_error": float(np.max(density)),
    }
    if size > 1:
        both = counts[:, :, None] & counts[:, None, :] & ~np.eye(size, dtype=bool)
        scale = np.where(both, np.sqrt(auto[:, :, None] * auto[:, None, :]), 1.0)
        own = np.where(both, np.sqrt(found[:, :, None] * found[:, None, :]), 1.0)
        cross = np.where(both, np.abs(model - target) / scale, 0.0)
        coherence = np.where(both, np.abs(model) / own - np.abs(target) / scale, 0.0)
        result["cross_error_max"] = float(np.max(cross))
        result["cross_error_rms"] = float(np.sqrt(np.sum(cross**2) / max(np.sum(both), 1)))
        result["coherence_error_max"] = float(np.max(np.abs(coherence)))
    return result


def model_errors(
    model: ArmaModel, target: Array, frequency: FloatArray, variance: FloatArray, level: float
) -> dict[str, float]:
    """The figures of a `Certificate` that depend on the model.

    Parameters
    ----------
    target
        Cross-spectra at `frequency` (nf,), shape (nf, m, m).
    variance
        Of the target below the Nyquist frequency, shape (m,).
    level
        See `spectral_errors`.
    """
    ratio = np.diagonal(covariance(model, 0)[0]) / variance
    return spectral_errors(target, spectrum(model, frequency), frequency, level) | {
        "largest_pole": largest_pole(model),
        "round_off": round_off(model),
        "variance_error": float(np.max(np.abs(ratio - 1.0))),
    }
