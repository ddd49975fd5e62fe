"""Thin FMI 2.0 co-simulation adapters over `tlpsim.loads`, and the builder that packs them.

The contract that they keep is stated in docs/fmu-contract.md.
"""
