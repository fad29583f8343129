"""Constrained search for the best design, and the upper bound on any filter."""
