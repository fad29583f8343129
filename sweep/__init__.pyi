from .api.check import check, plan
from .api.evaluate import evaluate
from .api.inline_curves import read_curves
from .api.loading import lights, load_study, make_study, read_run, sensor, studies
from .api.new import new_study
from .api.objects import FinishedRun, LoadedStudy
from .api.run import run, show
from .base.answer import Answer
from .base.errors import SweepError
from .camera.pixel import Optics, Pixel
from .camera.scene import Scene, Target
from .designs.families.dual import Dual
from .designs.families.free_form import FreeForm
from .designs.families.stopband import MultiStopband, Stopband
from .features.audit.audit import audit
from .features.compare.compare import compare
from .features.describe.describe import describe
from .features.export.export import export
from .features.validate.validate import bench_template, validate
from .features.vision.export_images import export_images
from .features.vision.image_files import images
from .features.vision.score import scores
from .features.vision.score_report import score
from .metrics.quantity import Quantity
from .runs.listing import list_studies
from .runs.status import status
from .spectra.spectrum import WavelengthGrid

__version__: str
__all__ = [
    "Answer",
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
    "audit",
    "bench_template",
    "check",
    "compare",
    "describe",
    "evaluate",
    "export",
    "export_images",
    "images",
    "lights",
    "list_studies",
    "load_study",
    "make_study",
    "new_study",
    "plan",
    "read_curves",
    "read_run",
    "run",
    "score",
    "scores",
    "sensor",
    "show",
    "status",
    "studies",
    "validate",
]
