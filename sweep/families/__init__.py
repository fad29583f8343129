"""Families of filters: parameters in, QE curves of the modified channels out."""

from .base import Family, Parameter
from .stopband import Stopband

FAMILIES: dict[str, type[Stopband]] = {Stopband.kind: Stopband}
"""Every family that a study can name."""

__all__ = ["FAMILIES", "Family", "Parameter", "Stopband"]
