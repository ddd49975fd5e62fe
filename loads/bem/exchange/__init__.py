"""Hydrodynamic databases in the files of other codes; their conventions are in `conventions`, one module a code."""

from tlpsim.loads.bem.exchange.capytaine import read_capytaine, write_capytaine
from tlpsim.loads.bem.exchange.hams import read_hams
from tlpsim.loads.bem.exchange.nemoh import read_nemoh_results
from tlpsim.loads.bem.exchange.wamit import read_wamit, write_wamit
from tlpsim.loads.bem.exchange.wamit_quadratic import read_wamit_quadratic

__all__ = [
    "read_capytaine",
    "read_hams",
    "read_nemoh_results",
    "read_wamit",
    "read_wamit_quadratic",
    "write_capytaine",
    "write_wamit",
]
