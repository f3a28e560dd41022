"""The front door: one call of `diastole COMMAND ... --json` and its document."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
from collections.abc import Sequence
from typing import Any, Union

Word = Union[str, "os.PathLike[str]", int, float]


class DiastoleError(RuntimeError):
    """A command refused: `code` 1 is data that cannot be what they say, 2 wrong usage or input, 3 a fault of hardware or link; the text says what to do."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


def program() -> str:
    """The program's path: $DIASTOLE, else `diastole` on the path, else a build of this source tree."""
    named = os.environ.get("DIASTOLE") or shutil.which("diastole")
    if named:
        return named
    built = pathlib.Path(__file__).resolve().parents[2] / "build/release/bin/diastole"
    if built.is_file():
        return str(built)
    raise DiastoleError(2, "the program diastole is not on the path\n  Install the package diastole, or name it in $DIASTOLE.")


def call(command: str, *words: Word, cwd: Union[str, "os.PathLike[str]", None] = None) -> Any:
    """The document of a command. Exit code 1 with a document, a negative answer, is an answer; all else raises DiastoleError."""
    line: Sequence[str] = [program(), command, *(os.fspath(w) if not isinstance(w, (int, float)) else repr(w) for w in words), "--json"]
    ended = subprocess.run(line, cwd=cwd, capture_output=True, text=True, check=False)
    if ended.returncode not in (0, 1) or not ended.stdout.strip():
        raise DiastoleError(ended.returncode, ended.stderr.removeprefix("diastole: ").strip())
    return json.loads(ended.stdout)


def options(**named: Any) -> list[Word]:
    """`pressure_kPa=3.1, probe=[(22.5, 0, 0)], profile=True` as `--pressure-kPa 3.1 --probe 22.5,0,0 --profile`."""
    words: list[Word] = []
    for name, value in named.items():
        option = "--" + name.strip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, dict):
            for key, of_key in value.items():
                words += [option, f"{key}={of_key!r}" if isinstance(of_key, float) else f"{key}={of_key}"]
        elif isinstance(value, list):
            for each in value:
                words += [option, ",".join(map(str, each)) if isinstance(each, (tuple, list)) else each]
        elif isinstance(value, tuple):
            words += [option, ",".join(map(str, value))]
        else:
            words += [option, value]
    return words
