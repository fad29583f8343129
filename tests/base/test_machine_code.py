"""Machine code of kernels is that of the sources of all of them."""

from __future__ import annotations

import ast
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep
from sweep.base import machine_code
from sweep.base.errors import SweepError

PACKAGE = Path(sweep.__file__).parent
HELPER = "from .machine_code import njit\n@njit(cache=True)\ndef value(x):\n    return x + {}\n"
CALLER = "from .machine_code import njit\nfrom .b_kernels import value\n@njit(cache=True)\ndef twice(x):\n    return 2 * value(x)\n"


def test_every_file_that_compiles_is_a_source() -> None:
    found = set()
    for path in PACKAGE.rglob("*.py"):
        named = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom)]
        if any((one.module or "").endswith("machine_code") or one.module == "numba.extending" for one in named):
            found.add(path)
    assert found == set(machine_code.sources())


def test_a_kernel_is_compiled_anew_when_another_file_changes(tmp_path: Path) -> None:
    """Two files, of which one calls the other's kernel; each process has the second file as it is then."""
    package = tmp_path / "own"
    (package / "base").mkdir(parents=True)
    for name in ("machine_code.py", "errors.py"):
        shutil.copy(PACKAGE / "base" / name, package / "base" / name)
    (package / "base" / "a_kernels.py").write_text(CALLER)
    program = "from own.base.a_kernels import twice; print(twice(1), sum(twice.stats.cache_hits.values()))"
    said = []
    for more in (1, 15, 15):  # Python itself looks at a file's length, and at the second in which it was written
        (package / "base" / "b_kernels.py").write_text(HELPER.format(more))
        run = [sys.executable, "-c", program]
        done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
        said.append(done.stdout.split())
    assert said == [["4", "0"], ["32", "0"], ["32", "1"]]
    assert len(list((package / "__pycache__").glob("kernels-*"))) == 2


def _twice(x: float) -> float:
    return 2 * x + 1


def kernel() -> Any:
    """A kernel that is not loaded yet, as in a new process."""
    return machine_code.njit(cache=True)(_twice)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of machine code, in which nothing is yet but what one kernel has."""
    monkeypatch.setattr(machine_code.numba.config, "CACHE_DIR", str(tmp_path))
    assert kernel()(1.0) == 3.0
    (found,) = tmp_path.glob("kernels-*")
    return found


def hits(of: Any) -> int:
    return sum(of.stats.cache_hits.values())


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0x10]) + content[middle + 1 :]


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "cut": lambda content: content[: len(content) // 2],
    "random": lambda content: np.random.default_rng(1).bytes(len(content)),
    "flipped": flipped,
}


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_machine_code_is_compiled_anew(folder: Path, suffix: str, damage: str) -> None:
    (file,) = folder.rglob(f"*{suffix}")
    file.write_bytes(DAMAGES[damage](file.read_bytes()))
    again, after = kernel(), kernel()
    assert [again(1.0), hits(again), after(1.0), hits(after)] == [3.0, 0, 3.0, 1]


def test_machine_code_of_another_signature_is_not_run(folder: Path) -> None:
    """Two processes that compile a kernel at once may give their code one name."""
    with_ints = kernel()
    assert with_ints(1) == 3
    first, second = sorted(folder.rglob("*.nbc"))
    shutil.copy(first, second)
    with_ints = kernel()
    assert [with_ints(1), hits(with_ints)] == [3, 0]


def test_a_folder_that_is_removed_or_cannot_be_written_costs_nothing_but_time(folder: Path, tmp_path: Path) -> None:
    loaded = kernel()
    shutil.rmtree(folder)
    assert loaded(1.0) == 3.0
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    shutil.rmtree(folder)
    folder.write_text("in the way")
    assert loaded(1) == 3
    assert kernel()(1) == 3
    assert list(tmp_path.iterdir()) == [folder]


def test_others_cannot_write_machine_code(folder: Path) -> None:
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    folder.chmod(0o755)
    assert hits(kernel()) == 0
    for mode in (0o770, 0o707, 0o777):
        folder.chmod(mode)
        with pytest.raises(SweepError, match=r"others may change.*NUMBA_CACHE_DIR") as refused:
            kernel()
        assert (refused.value.exit_code, str(refused.value).count("\n")) == (2, 0)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_machine_code_of_another_user_is_not_run(folder: Path) -> None:
    os.chown(folder, 65534, -1)
    with pytest.raises(SweepError, match="others may change"):
        kernel()
