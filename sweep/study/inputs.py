"""The files of curves that a study was made from, in one archive beside it: it is read again without them."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile, ZipInfo

import numpy as np

from ..base.disk import is_folder, read_input
from ..base.errors import DataError, StudyError, ValidationIssue
from ..spectra.formats import is_curve_file
from ..spectra.read_text import MOST_BYTES
from ..spectra.spectrum import Curves

INPUTS = "inputs.zip"
"""Its name beside a `*.resolved.yaml`."""
_NAMES, _GIVEN = "names.json", ".given"
_MOST_UNPACKED = 2_000_000_000
_DAMAGES = (
    StopIteration,
    BadZipFile,
    zlib.error,
    EOFError,
    RuntimeError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
)
"""What zipfile and json raise for archives that are not as a run wrote them."""
Input = dict[str, bytes]
"""Bytes of a file, or of the files of a folder, by name; of curves that Python gave."""


def input_at(place: Path) -> Input:
    """Read a file of curves, or those of a folder that can be read."""
    content = {}
    for file in sorted(place.iterdir()) if is_folder(place) else [place]:
        with suppress(DataError):  # of no use to the study either
            if is_curve_file(file.name) or file == place:
                content[file.relative_to(place.parent).as_posix()] = read_input(file, MOST_BYTES, DataError)
    return content


def input_given(curves: Curves) -> Input:
    """Write curves that are in no file."""
    table = {name: values.tolist() for name, values in curves.values.items()}
    return {_GIVEN: json.dumps([curves.wavelength_nm.tolist(), table]).encode()}


def archive_of(inputs: Mapping[str, Input]) -> bytes:
    """Return an archive of inputs by their names in the study; the same bytes for the same inputs."""
    content = BytesIO()
    with ZipFile(content, "w") as archive:
        archive.writestr(ZipInfo(_NAMES), json.dumps([*inputs]))
        for number, files in enumerate(inputs.values()):
            for name, data in files.items():
                archive.writestr(ZipInfo(f"{number}/{name}"), data, ZIP_DEFLATED)
    return content.getvalue()


@contextmanager
def unpacked(archive: Path) -> Iterator[tuple[dict[str, Path], dict[str, Curves]]]:
    """Yield the places of the files of an archive, and curves that Python gave, by their names."""
    with ExitStack() as stack:
        try:
            content = _unpacked(archive, Path(stack.enter_context(TemporaryDirectory())))
        except OSError as error:
            raise StudyError(ValidationIssue(f"cannot be unpacked: {error.strerror or error}", str(archive))) from None
        except _DAMAGES as error:
            raise StudyError(ValidationIssue(f"is damaged: {type(error).__name__}", str(archive))) from None
        yield content


def _unpacked(archive: Path, folder: Path) -> tuple[dict[str, Path], dict[str, Curves]]:
    with ZipFile(archive) as content:
        if sum(info.file_size for info in content.infolist()) > _MOST_UNPACKED:
            raise StudyError(ValidationIssue("too large", str(archive), allowed=f"{_MOST_UNPACKED:,} bytes"))
        names = json.loads(content.read(_NAMES))
        content.extractall(folder)
    places = {name: next((folder / str(number)).iterdir()) for number, name in enumerate(names)}
    given = {}
    for name in [name for name, place in places.items() if place.name == _GIVEN]:
        wavelength_nm, table = json.loads(places.pop(name).read_bytes())
        given[name] = Curves(np.array(wavelength_nm), {key: np.array(values) for key, values in table.items()}, name)
    return places, given
