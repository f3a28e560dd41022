"""Run files, and the catalogue over them."""

from __future__ import annotations

import os
import pathlib
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from diastole import results
from diastole.program import call, options
from diastole.run_file import Column, RunFile

Path = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Note:
    """What somebody wrote about a run."""

    written_utc: str
    author: str
    text: str


class Run:
    """One run file (docs/run-file.md); ValueError if it claims what it has not. Columns are read when asked for; missing samples are NaN."""

    def __init__(self, path: Path) -> None:
        self.path = pathlib.Path(path)
        with closing(RunFile(self.path)) as file:
            if (root := file.attributes("/")).get("format") != "diastole-run" or root.get("format_version") != 1:
                raise ValueError(f"{self.path}: is no run file of Diastole, or one of another version (format_version) than 1")
            required = (str(root[name]) if name in root else file.refuse(f"attribute {name}", "is missing") for name in ("run_id", "started_utc", "producer"))
            self.run_id, self.started_utc, self.producer = required
            self.rig: dict[str, Any] = file.attributes("rig") or file.refuse("group /rig", "is missing")
            self.session: dict[str, Any] = file.attributes("session")
            notes = {note: file.attributes(note) for note in (f"session/notes/{number}" for number in file.names("session/notes"))}
            self.notes = [Note(of.get("written_utc", ""), of.get("author", ""), file.text(note)) for note, of in notes.items()]
            self.experiment = file.text("protocol/toml")
            self.segments = file.table("protocol/segments")
            self.channels = [name for name in file.names("pressure") if name.endswith("_kPa")]

    def column(self, dataset: str) -> Column:
        """Any dataset of numbers, by its path: "pump/commanded_mL"; KeyError if there is none."""
        with closing(RunFile(self.path)) as file:
            return file.numbers(dataset)

    @property
    def time_s(self) -> Column:
        return self.column("pressure/time_s")

    @property
    def cavity_kPa(self) -> Column:
        return self.column("pressure/cavity_kPa")

    @property
    def trigger_s(self) -> Column:
        return self.column("trigger/time_s")

    def volume_mL(self) -> Column:
        """The commanded volume at the pressure's times."""
        return np.interp(self.time_s, self.column("pump/time_s"), self.column("pump/commanded_mL"))

    def inspect(self) -> results.Inspection:
        return results.Inspection.from_json(call("inspect", self.path))

    def frames(self, frames: int = 16, **more: Any) -> results.FrameBins:
        """Pressure averaged into image frames; options as `diastole bin` has them."""
        return results.FrameBins.from_json(call("bin", self.path, *options(frames=frames, **more)))

    def note(self, text: str, author: str | None = None) -> None:
        call("note", self.path, text, *options(author=author))
        self.notes = Run(self.path).notes

    def _repr_html_(self) -> str:
        from diastole import pictures

        return pictures.of_run(self)


def simulate(experiment: Path, output: Path, **more: Any) -> Run:
    """A session on the simulated rig; options as `diastole simulate` has them: specimen="gel-7", seed=7, force=True."""
    call("simulate", experiment, "-o", output, *options(**more))
    return Run(output)


def runs(folder: Path = ".", *words: str, **more: Any) -> list[results.CatalogueEntry]:
    """What `diastole runs` finds: runs("sessions", "specimen=gel-7", "since=2026-11")."""
    return results.Catalogue.from_json(call("runs", folder, *words, *options(**more))).entries


def compare(*files: Path | Run, **more: Any) -> results.Comparison:
    """What tells runs apart; the first is what the others are compared with."""
    paths = [file.path if isinstance(file, Run) else file for file in files]
    return results.Comparison.from_json(call("compare", *paths, *options(**more)))
