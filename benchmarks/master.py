"""The master: orders of its algorithms, rates, wall time a macro step, kills, crashes, hostile input, long runs.

    python benchmarks/master.py [--quick]

Another master, ecos, is measured in the same run where the variable of the environment `TLPSIM_ECOS_PYTHON` names the
Python of an environment that has it, with the same NumPy:

    python -m venv cache/ecos && cache/ecos/bin/pip install ecospy tbb pythonfmu numpy
    TLPSIM_ECOS_PYTHON=cache/ecos/bin/python python benchmarks/master.py
"""

from __future__ import annotations

from master_coupling import causality, interpolation, orders
from master_faults import crashes, hostile, kills, soak
from master_speed import large_systems, speed
from report import main

if __name__ == "__main__":
    main("The master", [orders, interpolation, speed, large_systems, causality, kills, crashes, hostile, soak])
