"""Machine code of kernels is that of the sources of all of them."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import sweep
from sweep.base import machine_code

PACKAGE = Path(sweep.__file__).parent
HELPER = "from machine_code import njit\n@njit(cache=True)\ndef value(x):\n    return x + {}\n"
CALLER = "from machine_code import njit\nfrom compiled_b import value\n@njit(cache=True)\ndef twice(x):\n    return 2 * value(x)\n"


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
    (package / "base" / "machine_code.py").write_text(Path(machine_code.__file__).read_text())
    (package / "base" / "compiled_a.py").write_text(CALLER)
    program = "from compiled_a import twice; print(twice(1), sum(twice.stats.cache_hits.values()))"
    said = []
    for more in (1, 15, 15):  # Python itself looks at a file's length, and at the second in which it was written
        (package / "base" / "compiled_b.py").write_text(HELPER.format(more))
        run = [sys.executable, "-c", program]
        done = subprocess.run(run, cwd=package / "base", capture_output=True, text=True, check=True)
        said.append(done.stdout.split())
    assert said == [["4", "0"], ["32", "0"], ["32", "1"]]
    assert len(list((package / "__pycache__").glob("kernels-*"))) == 2
