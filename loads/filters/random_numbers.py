"""Counter-based random numbers: a number is a function of the seed, the stream and its index, and of nothing else.

Samples of a process can then be made again in any order, in another process or after going back in time, with the
same values. The generator is Philox-4x64 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", 2011).
"""

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]


def random_generator(seed: int, stream: int, block: int = 0) -> np.random.Generator:
    """Generator whose numbers depend on its three arguments alone.

    Parameters
    ----------
    seed, stream
        The key: the user's seed, and a number that keeps independent processes of one run apart.
    block
        Upper word of the counter; blocks never overlap.

    Raises
    ------
    ScenarioError
        If seed, stream or block is negative or takes more than 64 bits.
    """
    for name, value in (("seed", seed), ("stream", stream), ("block", block)):
        if not 0 <= value < 2**64:
            raise ScenarioError(f"random {name} is {value}; it must be a whole number from 0 to 2^64 - 1")
    key = np.array([seed, stream], dtype=np.uint64)
    counter = np.array([0, 0, block, 0], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))


def noise_block(seed: int, stream: int, block: int, rows: int, columns: int) -> FloatArray:
    """Independent standard normal numbers, shape (rows, columns), a function of the arguments alone."""
    return random_generator(seed, stream, block).standard_normal((rows, columns))
