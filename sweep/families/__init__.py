"""Families of filters: parameters in, QE curves of the modified channels out."""

from .base import Family, Parameter, SeparableFamily
from .build import MAKERS, FamilyOptions, Maker, build_family
from .dual import Dual
from .free_form import FreeForm
from .stopband import Stopband

__all__ = [
    "MAKERS",
    "Dual",
    "Family",
    "FamilyOptions",
    "FreeForm",
    "Maker",
    "Parameter",
    "SeparableFamily",
    "Stopband",
    "build_family",
]
