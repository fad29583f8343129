"""Groups of commands in the help, in order."""

STUDIES = "Studies"
RESULTS = "Results"
CURVES = "Files of curves"
TOOL = "The tool itself"
PANELS = (STUDIES, RESULTS, CURVES, TOOL)
