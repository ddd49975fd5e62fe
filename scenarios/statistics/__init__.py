"""Statistics of results: by frequency band, distributions, extremes, fatigue, each with its confidence interval."""
