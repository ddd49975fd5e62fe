"""The report of a run: one HTML page that holds its data, figures and scripts, and needs no network."""
