"""Metrics of a readout, constraints and objectives."""
