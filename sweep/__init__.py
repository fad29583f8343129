"""Sweeps and design-space exploration for color filter arrays that must tell traffic light colors apart.

Three lines of Python judge a filter of one's own:

>>> import sweep
>>> study = sweep.load_study("stopband")
>>> dn = study.evaluate(N=0.95 * study.curve("Y")).csd_yellow_red

Names are loaded when they are first used; what type they have stands in `__init__.pyi`.
"""

__version__ = "0.3.0"

_HOMES = {
    "load_study": "door.opening:opened_study",
    "make_study": "door.opening:made_study",
    "read_run": "door.opening:finished_run",
    "studies": "door.opening:studies",
    "evaluate": "door.asked:verdict_on",
    "sensor": "door.opening:own_sensor",
    "lights": "door.opening:own_lights",
    "read_curves": "door.given:curves_table",
    "LoadedStudy": "door.objects:LoadedStudy",
    "FinishedRun": "door.objects:FinishedRun",
    "Pixel": "camera.pixel:Pixel",
    "Optics": "camera.pixel:Optics",
    "Scene": "camera.scene:Scene",
    "Target": "camera.scene:Target",
    "WavelengthGrid": "curves.spectrum:WavelengthGrid",
    "Stopband": "designs.families.stopband:Stopband",
    "MultiStopband": "designs.families.stopband:MultiStopband",
    "Dual": "designs.families.dual:Dual",
    "FreeForm": "designs.families.free_form:FreeForm",
    "Quantity": "metrics.quantity:Quantity",
    "SweepError": "base.errors:SweepError",
}
"""Public name -> the module of the package that defines it, and its name there."""

__all__ = [*_HOMES, "__version__"]  # noqa: PLE0604  (all of them are texts)


def __getattr__(name: str) -> object:
    """A public name, loaded now (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415  (nothing is loaded with the package itself)

    module, _, attribute = _HOMES[name].partition(":")
    found = globals()[name] = getattr(import_module(f".{module}", __name__), attribute)
    return found


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
