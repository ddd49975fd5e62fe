"""A master for FMI co-simulation: any components, any wiring, any rates.

Who steps when (`execution`), what is stepped (`instance`, `fmu`), how values pass between rates
(`coupling`) and who watches (`observers`) are kept apart. The master knows nothing of platforms, wind or
waves.
"""
