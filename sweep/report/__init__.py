"""What a person sees of a finished run: summary lines, figures, the HTML reports."""

from .accuracy import AccuracyReport, make_accuracy_report, read_hard_cases
from .make import make_report
from .outputs import Output, check_kept, read_output, study_of
from .summary import summary_lines

__all__ = [
    "AccuracyReport",
    "Output",
    "check_kept",
    "make_accuracy_report",
    "make_report",
    "read_hard_cases",
    "read_output",
    "study_of",
    "summary_lines",
]
