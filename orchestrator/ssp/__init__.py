"""System descriptions of the standard SSP."""
