"""A master for FMI co-simulation: any components, any wiring, any rates.

    system, units, arrays, graph    what is connected, and what can be said of it before anything runs
    instance                        the interface of a component, and one made of Python functions
    fmi/                            FMUs of FMI 2.0 and 3.0 as components, for co-simulation and model exchange
    table, isolation                time series as a component; a component in a process of its own
    ssp/                            systems by the standard SSP
    loop/                           the steps: links between rates, the compiled loop, the algorithms of loops
    execution, checkpoint           a run from its beginning to its end, and what it needs to go on after a kill
    observers, coupling_report      who watches a run, and what the coupling costs in accuracy

The master knows nothing of platforms, wind or waves.
"""
