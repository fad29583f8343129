"""Families of filters: parameters in, QE curves of the modified channels out."""

from .base import Family, Parameter, SeparableFamily
from .build import CHANNELS, FamilyOptions, build_family
from .dual import Dual
from .free_form import FreeForm
from .stopband import Stopband

__all__ = [
    "CHANNELS",
    "Dual",
    "Family",
    "FamilyOptions",
    "FreeForm",
    "Parameter",
    "SeparableFamily",
    "Stopband",
    "build_family",
]
