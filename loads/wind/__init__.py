"""Wind: mean profile, spectra, coherence, sampled turbulence and the forces on a platform."""
