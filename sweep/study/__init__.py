"""Study files: YAML in, frozen and fully checked objects out, before any work."""

from .load import folder_name, load_study, sensor_studies_in, study_of_keys
from .model import Search, Study
from .schema import StudySection
from .sensor_studies import SensorAndLights, SensorStudies
from .sources import KeptSources

__all__ = [
    "KeptSources",
    "Search",
    "SensorAndLights",
    "SensorStudies",
    "Study",
    "StudySection",
    "folder_name",
    "load_study",
    "sensor_studies_in",
    "study_of_keys",
]
