"""Curve files that are damaged, too large or hold numbers that nothing can be computed with: one line each."""

from __future__ import annotations

import os
import struct
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from sweep.base.errors import DataError
from sweep.spectra.formats import read_curves, scan_curves
from sweep.spectra.read_table import MOST_CURVES
from sweep.spectra.spectrum import LARGEST, LEAST_PEAK, check_samples

from ..watchdog import within

HANG_S = 120.0
WAVE = np.arange(400, 701, 10.0)


def mat(compressed: bool = True, **more: object) -> bytes:
    content = BytesIO()
    names = np.array([["rRed", "gGreen"]], dtype=object)
    data = np.stack([WAVE / 700, 1 - WAVE / 1000], axis=1)
    savemat(
        content, {"wavelength": WAVE[:, None], "data": data, "filterNames": names} | more, do_compression=compressed
    )
    return content.getvalue()


def test_mat_of_isetcam(tmp_path: Path) -> None:
    path = tmp_path / "filter.mat"
    path.write_bytes(mat(comment="x"))
    curves = read_curves(path)
    assert list(curves.values) == ["rRed", "gGreen"]
    np.testing.assert_array_equal(curves.values["gGreen"], 1 - WAVE / 1000)


def refused(path: Path, content: bytes) -> str:
    path.write_bytes(content)
    with pytest.raises(DataError) as caught, within(HANG_S):
        read_curves(path)
    assert len(caught.value.issues) == 1, str(caught.value)
    return str(caught.value).replace(str(path), "FILE")


@pytest.mark.parametrize("compressed", [False, True])
def test_every_flipped_bit_of_a_mat_is_one_line_or_read(tmp_path: Path, compressed: bool) -> None:
    whole, path = mat(compressed), tmp_path / "a.mat"
    rng = np.random.default_rng(1)
    n_refused = 0
    for at in rng.integers(116, len(whole), 150):
        content = bytearray(whole)
        content[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        try:
            with within(HANG_S):
                read_curves(path)
        except DataError as error:
            assert len(str(error).splitlines()) <= 2  # one for each curve  # noqa: PT017
            n_refused += 1
    assert n_refused > 20


def test_every_cut_of_a_mat_is_one_line(tmp_path: Path) -> None:
    for compressed in (False, True):
        whole = mat(compressed)
        for length in range(0, len(whole) - 1, 37):
            assert refused(tmp_path / "a.mat", whole[:length]).startswith("FILE: ")


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def array(name: bytes, dimensions: tuple[int, ...], data: bytes, kind: int = 6) -> bytes:
    """An uncompressed variable of version 5 that says of itself what it is told to."""
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack(f"<{len(dimensions)}i", *dimensions))
    return element(14, head + element(1, name) + data)


HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
FINE = array(b"wavelength", (31, 1), element(9, WAVE.tobytes()))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (FINE + array(b"data", (2**31 - 1, 2**31 - 1), element(9, bytes(16))), "not a size of curves"),
        (FINE + array(b"data", (-1, 31), element(9, bytes(16))), "not a size of curves"),
        (FINE + array(b"data", (2, 1), array(b"", (1, 1), b"", kind=1), kind=1), "must be real numbers"),
        (FINE + array(b"data", (31, 1), element(9, bytes(8))), "not a readable .mat file"),
        (FINE + struct.pack("<II", 14, 2**32 - 1), "not a readable .mat file"),
        (FINE + element(99, b"12345678"), "not a readable .mat file"),
        (struct.pack("<II", 15, 8) + zlib.compress(b"abc")[:8], "not a readable .mat file"),
    ],
)
def test_a_damaged_mat_is_one_line(tmp_path: Path, content: bytes, said: str) -> None:
    assert said in refused(tmp_path / "a.mat", HEADER + content)


def lines(path: Path, header: str, *rows: str) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_tables_that_are_too_large_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    curves, samples = 50, 1000
    monkeypatch.setattr("sweep.spectra.read_table.MOST_CURVES", curves)
    monkeypatch.setattr("sweep.spectra.read_table.MOST_SAMPLES", samples)
    names = ",".join(f"c{i}" for i in range(2 * curves))
    wide = lines(
        tmp_path / "wide.csv",
        "wavelength_nm," + names,
        *[f"{400 + i},{','.join(['0.5'] * 2 * curves)}" for i in range(3)],
    )
    long = lines(tmp_path / "long.csv", "wavelength_nm,a", *[f"{400 + i * 1e-4:.4f},1" for i in range(samples + 1)])
    large = tmp_path / "large.csv"
    with large.open("wb") as handle:
        handle.truncate(10**12)
    for path, said in ((wide, "too many curves"), (long, "too many samples"), (large, "the file is too large")):
        with pytest.raises(DataError, match=said), within(HANG_S):
            read_curves(path)


def test_tables_up_to_the_limits_are_read(tmp_path: Path) -> None:
    names = ",".join(f"c{i}" for i in range(MOST_CURVES))
    rows = [f"{400 + i},{','.join(['0.5'] * MOST_CURVES)}" for i in range(20)]
    with within(HANG_S):
        assert len(read_curves(lines(tmp_path / "wide.csv", "wavelength_nm," + names, *rows)).values) == MOST_CURVES


def test_of_many_faults_reading_stops(tmp_path: Path) -> None:
    names = ",".join(f"c{i}" for i in range(1000))
    rows = [f"{400 + i},{','.join((['x', '1'], ['1', 'x'])[i % 2] * 500)}" for i in range(300)]
    path = lines(tmp_path / "bad.csv", "wavelength_nm," + names, *rows)
    with within(HANG_S):
        scan = scan_curves(path)
    assert f"{path}:22: too many errors" in str(scan.issues[0][-1])


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("1e308", "FILE:3: a: value too large"),
        ("1" * 5000, "FILE:3: a: not a usable number"),
        ("1_0", "not a usable number (got '1_0')"),
        ("\uff11", "not a usable number"),
        ("infinity", "not a usable number"),
        ("1e-400000000000", None),
        ("-0.0", None),
        (" +1.5e-3\t", None),
        (".5", None),
    ],
)
def test_numbers_of_tables(tmp_path: Path, cell: str, said: str | None) -> None:
    path = lines(tmp_path / "a.csv", "wavelength_nm,a", "400,1", f"500,{cell}", "700,1")
    if said is None:
        found = read_curves(path).values["a"][1]
        assert found == float(cell)
        assert not np.signbit(found)
    else:
        assert said in refused(path, path.read_bytes())


def test_values_that_nothing_can_be_computed_with() -> None:
    check_samples([400, 700], [LARGEST, 5e-324])
    check_samples([400, 700], [LEAST_PEAK, 0])
    check_samples([400, 700], [0, 0])
    with pytest.raises(DataError, match="value at 700 nm is too large"):
        check_samples([400, 700], [1, 1.01 * LARGEST])
    with pytest.raises(DataError, match="the largest value is too small"):
        check_samples([400, 700], [0, 0.99 * LEAST_PEAK])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_pipes_are_no_curve_files(tmp_path: Path) -> None:
    for name in ("pipe.csv", "pipe.mat"):
        os.mkfifo(tmp_path / name)
    for path in (tmp_path / "pipe.csv", tmp_path / "pipe.mat"):
        with pytest.raises(DataError, match="not a file"), within(HANG_S):
            read_curves(path)
