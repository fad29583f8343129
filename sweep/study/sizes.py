"""A study is neither empty nor too large."""

from __future__ import annotations

from ..base.errors import StudyError
from ..camera.memory import too_large
from .model import Study
from .sources import Sources

MOST_DESIGNS = 10**9


def check_memory(study: Study, sources: Sources) -> None:
    """The kernels of every scene and CFA fit into memory. Raises StudyError."""
    for name in study.scenarios:
        for space in study.spaces:
            if (refused := too_large(study.setup(space, name))) is not None:
                problem, value, allowed = refused
                sources.add(("scenarios", name, "target"), f"{problem} (CFA {space.cfa})", value, allowed)
                raise StudyError(sources.faults)


def check_count(study: Study, sources: Sources) -> None:
    """There are designs, and not too many. Raises StudyError."""
    if not study.n_designs and study.search is None:
        sources.add(("cfas",), "no designs", None, "a CFA with a curve for each channel, a design, a sweep or a search")
        raise StudyError(sources.faults)
    if study.n_designs > MOST_DESIGNS:
        sources.add(("sweeps",), "too many designs", f"{study.n_designs:,}", f"at most {MOST_DESIGNS:,}")
        raise StudyError(sources.faults)
