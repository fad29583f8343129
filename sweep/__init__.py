"""Sweeps and design-space exploration for color filter arrays that must tell traffic light colors apart."""

__version__ = "0.1.0"
