"""Ready scripts, one for each question: `python -m tlpsim.scenarios.scripts.free_decay`. Copy one, and change it."""
