"""The frequency domain: response statistics of a scenario without any time stepping."""
