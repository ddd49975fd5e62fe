"""Waves: spectra, linear wave theory and irregular seas as sums of components."""
