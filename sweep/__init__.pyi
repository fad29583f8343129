from .api.evaluate import evaluate
from .api.finished_run import FinishedRun
from .api.inline_curves import read_curves
from .api.loaded_study import LoadedStudy
from .api.loading import lights, load_study, make_study, read_run, sensor, studies
from .base.errors import SweepError
from .camera.pixel import Optics, Pixel
from .camera.scene import Scene, Target
from .designs.families.dual import Dual
from .designs.families.free_form import FreeForm
from .designs.families.stopband import MultiStopband, Stopband
from .metrics.quantity import Quantity
from .spectra.spectrum import WavelengthGrid

__version__: str
__all__ = [
    "Dual",
    "FinishedRun",
    "FreeForm",
    "LoadedStudy",
    "MultiStopband",
    "Optics",
    "Pixel",
    "Quantity",
    "Scene",
    "Stopband",
    "SweepError",
    "Target",
    "WavelengthGrid",
    "__version__",
    "evaluate",
    "lights",
    "load_study",
    "make_study",
    "read_curves",
    "read_run",
    "sensor",
    "studies",
]
