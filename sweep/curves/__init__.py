"""Curves over wavelength: sampled, read from any file, written, colored, built in."""
