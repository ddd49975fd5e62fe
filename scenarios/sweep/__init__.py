"""Many scenarios at once: cases of a plan, on the workers of a Dask cluster, with resume, to one summary table."""
