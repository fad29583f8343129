"""Groups of commands in the help, in order."""

OF_STUDIES = "Studies"
OF_RESULTS = "Results"
OF_CURVES = "Files of curves"
OF_TOOL = "The tool itself"
PANELS = (OF_STUDIES, OF_RESULTS, OF_CURVES, OF_TOOL)
