"""Study files: YAML in, frozen and fully checked objects out, before any work."""

from .load import folder_name, load_study
from .model import Search, Study

__all__ = ["Search", "Study", "folder_name", "load_study"]
