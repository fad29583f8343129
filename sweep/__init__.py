"""Sweeps and design-space exploration for color filter arrays (CFAs) that must separate traffic light colors.

Three lines of Python evaluate a filter:

>>> import sweep
>>> study = sweep.load_study("stopband")
>>> dn = study.evaluate(N=0.95 * study.curve("Y")).csd_yellow_red[0]

What the commands of `sweep` do, functions of their names do, too: `sweep.run("stopband")` returns what it prints. `new`
is `new_study`, `list` is `list_studies`, `open` is `show`; `read_run(...).report()` draws a report again.

Names are loaded at their first use; `__init__.pyi` has their types.
"""

from .features import public

__version__ = "0.3.0"

_LOCATIONS = public() | {
    "load_study": "api.loading:load_study",
    "make_study": "api.loading:make_study",
    "read_run": "api.loading:read_run",
    "studies": "api.loading:studies",
    "list_studies": "runs.listing:list_studies",
    "check": "api.check:check",
    "plan": "api.check:plan",
    "new_study": "api.new:new_study",
    "run": "api.run:run",
    "status": "runs.status:status",
    "show": "api.run:show",
    "evaluate": "api.evaluate:evaluate",
    "sensor": "api.loading:sensor",
    "lights": "api.loading:lights",
    "read_curves": "api.inline_curves:read_curves",
    "LoadedStudy": "api.objects:LoadedStudy",
    "FinishedRun": "api.objects:FinishedRun",
    "Pixel": "camera.pixel:Pixel",
    "Optics": "camera.pixel:Optics",
    "Scene": "camera.scene:Scene",
    "Target": "camera.scene:Target",
    "WavelengthGrid": "spectra.spectrum:WavelengthGrid",
    "Stopband": "designs.families.stopband:Stopband",
    "MultiStopband": "designs.families.stopband:MultiStopband",
    "Dual": "designs.families.dual:Dual",
    "FreeForm": "designs.families.free_form:FreeForm",
    "Answer": "base.answer:Answer",
    "Quantity": "metrics.quantity:Quantity",
    "SweepError": "base.errors:SweepError",
}
"""Public name to the module that defines it, and its name there."""

_OF_STUDIES = ("Pixel", "Optics", "Scene", "Target", "WavelengthGrid")
"""Sections of a study, whose keys have docstrings of their own."""
__all__ = [*_LOCATIONS, "__version__"]  # noqa: PLE0604  (all of them are texts)


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name not in _LOCATIONS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415  (nothing is loaded with the package itself)

    module, _, attribute = _LOCATIONS[name].partition(":")
    value = globals()[name] = getattr(import_module(f".{module}", __name__), attribute)
    if name in _OF_STUDIES:
        value.__doc__ = import_module(".base.types", __name__).with_keys(value)
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
