"""Flicker of a pulsed lamp in the captures of an HDR pixel."""
