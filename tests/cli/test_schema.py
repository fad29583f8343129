"""`sweep schema`: the JSON Schema of study files, which replaces none but its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.api.new import write_schema
from sweep.base.errors import OutputError
from sweep.study.editors import schema_text


def test_a_schema_replaces_only_a_schema(tmp_path: Path) -> None:
    path = tmp_path / "study.schema.json"
    path.write_text('{"title": "A study of sweep", "older": true}')
    for _ in range(2):  # also one that it wrote itself
        write_schema(path)
        assert path.read_text() == schema_text()
    path.write_text(schema_text().replace("A study of sweep", "StudySection", 1))  # and of an earlier version
    write_schema(path)
    assert path.read_text() == schema_text()
    path.unlink()
    path.symlink_to("/dev/zero")  # it never ends
    with pytest.raises(OutputError, match="not a file"):
        write_schema(path)
    path.unlink()
    for held in ("mine", '{"title": "mine"}', "[]"):
        path.write_text(held)
        with pytest.raises(OutputError, match="holds something else already"):
            write_schema(path)
        assert path.read_text() == held
