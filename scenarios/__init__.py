"""The user's edge: scenario schema, assembly into a system, results, statistics and the command line."""
