"""The digital filters: ARMA fits and their samples, kernels, interpolation, waves by filters.

python benchmarks/filters.py [--quick]
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # small matrices: threads only get in each other's way

import filters_kernels
import filters_processes
import filters_waves
from report import main

if __name__ == "__main__":
    main("The digital filters", [*filters_processes.PARTS, *filters_kernels.PARTS, *filters_waves.PARTS])
