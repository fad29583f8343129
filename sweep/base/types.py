"""Names of array types; the base of every section of a study file, and its numbers; who is told of progress; calls."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from textwrap import dedent
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from jaxtyping import Bool as Bool
from jaxtyping import Float as Float
from jaxtyping import Int as Int
from jaxtyping import Num as Num
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from ..features import modules
from .errors import StudyError, ValidationIssue

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass

    Array = FloatArray
else:
    ModelMetaclass = type(BaseModel)
    Array = np.ndarray
"""An array whose numbers the name before the bracket says, and whose shape the text behind it."""

PerWavelength = Float[Array, " wavelengths"]
PerChannel = Float[Array, " channels"]
PerDesign = Float[Array, " designs"]
PerParameter = Float[Array, " parameters"]
PerSample = Float[Array, " samples"]
PerTerm = Float[Array, " terms"]
PerRow = Float[Array, " rows"]
PerKnot = Float[Array, " knots"]
PerFree = Float[Array, " free"]
"""One number for each parameter that a search may change."""
PerValue = Float[Array, " values"]
"""Numbers of any meaning in one row."""
PerCapture = Float[Array, "captures ..."]
"""Captures of an HDR pixel on the first axis."""
SameShape = Float[Array, "*batch"]
"""Of any shape, which is the same wherever this stands in one signature."""
DesignCurves = Float[Array, "designs modified wavelengths"]
"""QE of the modified channels of designs."""
ChannelCurves = Float[Array, "modified wavelengths"]
"""QE of the modified channels of one design."""
CurvesGradient = Float[Array, "parameters modified wavelengths"]
DesignParameters = Float[Array, "designs parameters"]
DesignSignals = Float[Array, "designs signals channels"]
"""What the channels say of each signal, in one case."""
DesignCases = Float[Array, "designs cases signals channels"]
"""What the channels say of each signal, at each sampling phase, field position and moment."""
ParameterWeights = Float[Array, "_conditions parameters"]
"""Linear functions of the parameters, one in a row."""
DesignNumbers = Int[IndexArray, " designs"]
ImageNumbers = Int[IndexArray, " images"]
MemberNumbers = Int[IndexArray, " _members"]
"""Rows of the signals of a type, whose number differs from type to type."""

Progress = Callable[[str, int, int], None]
"""Called with a phase, how much of it is done, and how much there is."""
Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]
"""A call that is put off, in the form that joblib takes."""
Parallel = Callable[[Iterable[Call]], Iterator[Any]]
"""Answers of calls, which may be spread over the cores, in their order."""


def silent(*_: object) -> None:
    """Show no progress, and say nothing."""


def delayed(function: Callable[..., Any], *arguments: Any) -> Call:
    """Record a call without making it."""
    return function, arguments, {}


def in_turn(calls: Iterable[Call]) -> Iterator[Any]:
    """Make recorded calls one after the other in this process."""
    for function, arguments, named in calls:
        yield function(*arguments, **named)


class _Told(ModelMetaclass):
    """Class whose calls tell what is wrong as all of the package does."""

    def __call__(self, *arguments: Any, **keys: Any) -> Any:
        try:
            return super().__call__(*arguments, **keys)
        except ValidationError as error:
            raise StudyError(
                [
                    ValidationIssue(item["msg"], key=".".join(map(str, item["loc"])), value=item["input"])
                    for item in error.errors(include_url=False)
                ]
            ) from None


class Section(BaseModel, metaclass=_Told):
    """Frozen section of a study; unknown keys, NaN, infinity and quoted numbers are refused.

    The docstring below a field is its description, which `study.editors` reads. Validators are built at the first use,
    since most sections are in no study.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        strict=True,
        defer_build=True,
    )

    def key(self, name: str) -> Any:
        """Return the value of a key that a feature adds; None where nothing is stated."""
        return getattr(self, name, None)


_Section = TypeVar("_Section", bound=Section)


def with_keys_of_features(section: type[_Section]) -> type[_Section]:
    """Return a section with the keys that features add to it, whose names they say in `KEYS`."""
    every = [getattr(module, "KEYS", {}) for module in modules("section")]
    added = [keys[section.__name__] for keys in every if section.__name__ in keys]
    return create_model(
        section.__name__, __base__=(*added, section), __module__=section.__module__, __doc__=section.__doc__
    )


def key_texts(owners: Iterable[type]) -> dict[str, str]:
    """Return the docstrings below the keys of sections, by name."""
    texts = {}
    for owner in owners:
        if not issubclass(owner, Section):
            continue
        try:
            source = dedent(inspect.getsource(owner))
        except OSError:  # pydantic's `create_model` made it
            continue
        for key, text in pairwise(ast.parse(source).body[0].body):  # type: ignore[attr-defined]  # a class
            match key, text:
                case ast.AnnAssign(target=ast.Name(name)), ast.Expr(ast.Constant(str(words))):
                    texts[name] = inspect.cleandoc(words)
    return texts


def with_keys(section: type[Section]) -> str:
    """Return the docstring of a section with its keys, for `help`."""
    texts, keys = key_texts(reversed(section.__mro__)), list[str]()
    for name, field in section.model_fields.items():
        default = "" if field.is_required() else f", default {field.default!r}"
        keys.append(f"{name}{default}\n    " + texts[name].replace("\n", "\n    "))
    return "\n".join([inspect.cleandoc(section.__doc__ or ""), "", "Parameters", "----------", *keys])


def from_to(value: Any) -> Any:
    """Convert a list of two numbers to a tuple.

    Raises ValueError if the value is no pair.
    """
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError("two numbers, from and to")
    return tuple(value)


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]

# Physical quantities have limits several orders of magnitude beyond any hardware or scene. They keep every product and
# quotient of a study inside what a float holds, so that no result is an overflow.
Number = Annotated[float, Field(ge=-1e30, le=1e30)]
"""Any number of a study that is no physical quantity of its own: values of an axis, printed figures."""
Share = Annotated[float, Field(ge=1e-9, le=1)]
"""A share of a whole of which something is left."""
Ratio = Annotated[float, Field(ge=1e-30, le=1e30)]
"""A factor between two scales."""
Meters = Annotated[float, Field(ge=1e-4, le=1e9)]
"""0.1 mm to a million kilometers: from less than any lamp to beyond the Moon."""
Seconds = Annotated[float, Field(ge=1e-15, le=1e9)]
"""Femtoseconds to 30 years."""
