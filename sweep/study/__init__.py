"""Study files: YAML in, frozen and fully checked objects out, before any work."""

from .load import folder_name, load_study, sensor_studies_in, study_of_keys
from .members import SensorAndLights, SensorStudies
from .model import Search, Study
from .schema import StudySection

__all__ = [
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
