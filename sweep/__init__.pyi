from .base.errors import SweepError
from .camera.pixel import Optics, Pixel
from .camera.scene import Scene, Target
from .curves.spectrum import WavelengthGrid
from .designs.families.dual import Dual
from .designs.families.free_form import FreeForm
from .designs.families.stopband import MultiStopband, Stopband
from .door.asked import verdict_on as evaluate
from .door.given import curves_table as read_curves
from .door.objects import FinishedRun, LoadedStudy
from .door.opening import finished_run as read_run
from .door.opening import made_study as make_study
from .door.opening import opened_study as load_study
from .door.opening import own_lights as lights
from .door.opening import own_sensor as sensor
from .door.opening import studies
from .metrics.quantity import Quantity

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
