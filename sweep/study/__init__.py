"""Study files: YAML in, frozen and fully checked objects out, before any work."""

from .load import folder_name, load_study, several_in, study_of_keys
from .model import Search, Study
from .schema import StudySection
from .several import Member, SeveralStudies
from .sources import KeptSources

__all__ = [
    "KeptSources",
    "Member",
    "Search",
    "SeveralStudies",
    "Study",
    "StudySection",
    "folder_name",
    "load_study",
    "several_in",
    "study_of_keys",
]
