"""Studies: what is fitted to what."""

from __future__ import annotations

import os
import pathlib
import tomllib
from typing import Any, Union

from diastole import results
from diastole.program import call, options

Path = Union[str, "os.PathLike[str]"]


class Study:
    """A study file. Options of its commands are keywords: solve(pressure_kPa=3.1, probe=[(22.5, 0, 0)], set={"C1_kPa": 8.8})."""

    def __init__(self, path: Path) -> None:
        self.path = pathlib.Path(path)
        with open(self.path, "rb") as file:
            self.table: dict[str, Any] = tomllib.load(file)
        if self.table.get("format") != "diastole-study":
            raise ValueError(f"{self.path}: is no study of Diastole")

    def solve(self, pressure_kPa: float | None = None, **more: Any) -> results.Solution:
        return results.Solution.from_json(call("solve", self.path, *options(pressure_kPa=pressure_kPa, **more)))

    def fit(self, **more: Any) -> results.Fit:
        return results.Fit.from_json(call("fit", self.path, *options(**more)))

    def explain(self, folder: Path, **more: Any) -> results.Explanation:
        """Writes its files into `folder`."""
        return results.Explanation.from_json(call("explain", self.path, "-o", folder, *options(**more)))

    def track(self, output: Path, **more: Any) -> results.Tracking:
        """Follows the tags of the study's images ([data] images) into a file of tag points."""
        images = self.table.get("data", {}).get("images")
        if images is None:
            raise ValueError(f"{self.path}: [data] images names no folder")
        return results.Tracking.from_json(call("track", self.path.parent / images, "-o", output, *options(**more)))

    def _repr_html_(self) -> str:
        from diastole import pictures

        return pictures.of_study(self)
