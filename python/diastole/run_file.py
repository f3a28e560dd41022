"""A run file, opened with h5py as a stranger's may be: what it claims is held against what it has before memory is taken, by the
rules of the program (protocol/runfile/h5_source.hpp)."""

from __future__ import annotations

import math
import pathlib
from typing import Any, NoReturn

import h5py  # type: ignore[import]
import numpy as np
import numpy.typing as npt

Column = npt.NDArray[np.float64]

MOST_SAMPLES, MOST_ROWS = 1 << 27, 1 << 24
MOST_CHUNK_BYTES, MOST_INFLATION = 16 << 20, 1100  # of what is unpacked at a time; by deflate
OWN_FILTERS = range(1, 7)  # h5z.h: deflate, shuffle and the like; others are loaded from plug-ins
NUMBERS, TEXTS = (h5py.h5t.INTEGER, h5py.h5t.FLOAT), (h5py.h5t.STRING,)


class RunFile:
    """Raises OSError for what is no HDF5 file; every method raises ValueError with file, place and reason, but KeyError for what may be absent."""

    def __init__(self, path: pathlib.Path) -> None:
        self.path = path
        try:
            self._file = h5py.File(path, "r")
        except OSError as error:
            raise type(error)(f"{path}: {error}") from error
        self._bytes = self._text_bytes_left = path.stat().st_size
        self._datasets: list[str] = []
        try:
            self._expect_own_links()
            self._file.visititems(lambda name, found: self._expect_own_values(name, found) if isinstance(found, h5py.Dataset) else None)
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        self._file.close()

    def numbers(self, path: str) -> Column:
        """Of a recording's streams, or of triggers and the like, which are fewer."""
        if not isinstance(self._file.get(path), h5py.Dataset):
            raise KeyError(f"{self.path}: has no dataset {path}, but {', '.join(self._datasets)}")
        data = self._dataset(path, NUMBERS, "numbers")
        return np.asarray(data[: self._rows(data)], dtype=np.float64)

    def text(self, path: str) -> str:
        data = self._dataset(path, TEXTS, "text")
        return str(self._value(data[(0,) * data.ndim])) if data.size == 1 else self.refuse(f"dataset {data.name}", "does not hold one text")

    def table(self, path: str) -> list[dict[str, Any]]:
        """Row by row: of texts that share their bytes no more is read than the file has."""
        data = self._dataset(path, (h5py.h5t.COMPOUND,), "a table")
        if any(data.id.get_type().get_member_class(i) not in NUMBERS + TEXTS for i in range(data.id.get_type().get_nmembers())):
            self.refuse(f"dataset {data.name}", "is no table of numbers and texts")
        return [{name: self._value(value) for name, value in zip(data.dtype.names, data[i])} for i in range(self._rows(data))]

    def attributes(self, path: str) -> dict[str, Any]:
        """Those that are one number or one text; none of what is not there."""
        attributes, values = self._file[path].attrs if path in self._file else {}, {}
        for name in attributes:
            found, kind = attributes.get_id(name), attributes.get_id(name).get_type()
            if kind.get_class() in NUMBERS + TEXTS and kind.get_size() <= self._bytes and found.get_space().get_simple_extent_npoints() == 1:
                values[name] = self._value(np.asarray(attributes[name], dtype=object).reshape(-1)[0])
        return values

    def names(self, path: str) -> list[str]:
        """What a group holds; nothing if it is not there."""
        group = self._file[path] if path in self._file else {}
        if isinstance(group, h5py.Dataset):
            self.refuse(f"group /{path}", "is a dataset")
        return sorted(group)

    def refuse(self, place: str, problem: str) -> NoReturn:
        where = f"{self.path}: {place}: " if place else f"{self.path}: "
        raise ValueError(f"{where}{problem}\n  It was damaged or made to do harm. Give the file that the daemon wrote.")

    def _value(self, value: Any) -> Any:
        if not isinstance(value, (bytes, str)):
            return value.item() if isinstance(value, np.generic) else value
        self._text_bytes_left -= len(value)
        if self._text_bytes_left < 0:
            self.refuse("", f"has texts of more than its {self._bytes} bytes")
        return value.decode(errors="replace") if isinstance(value, bytes) else value

    def _dataset(self, path: str, kinds: tuple[int, ...], kind: str) -> Any:
        found = self._file[path] if path in self._file else None
        if not isinstance(found, h5py.Dataset):
            self.refuse(f"dataset /{path}", "is missing")
        if found.id.get_type().get_class() not in kinds:
            self.refuse(f"dataset {found.name}", f"does not hold {kind}")
        return found

    def _rows(self, data: Any) -> int:
        most = MOST_SAMPLES if data.name.startswith(("/pressure/", "/pump/")) else MOST_ROWS
        if data.ndim != 1 or len(data) > most:
            self.refuse(f"dataset {data.name}", f"claims {' x '.join(map(str, data.shape or ()))} rows, and up to {most} are read")
        return len(data)

    def _expect_own_links(self) -> None:
        """Hard and soft links only: others lead to what another file or a plug-in says."""
        own = (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT)
        try:
            self._file.id.links.exists(b"rig")  # raises for damage on which the library's visit would end this process
            foreign = self._file.id.links.visit(lambda name, link: None if link.type in own else name, info=True)
        except RuntimeError:
            self.refuse("", "has groups that cannot be read")
        if foreign:
            self.refuse(f"link /{foreign.decode(errors='replace')}", "leads out of the file, which no run file's does")

    def _expect_own_values(self, name: str, data: Any) -> None:
        """They lie in this file, are no more than its bytes can hold, and are unpacked by the library itself."""
        made, place = data.id.get_create_plist(), f"dataset /{name}"
        self._datasets.append(name)
        layout, filters = made.get_layout(), [made.get_filter(i)[0] for i in range(made.get_nfilters())]
        if layout == h5py.h5d.VIRTUAL or made.get_external_count() > 0:
            self.refuse(place, "takes its values from another file, which no run file's does")
        if any(each not in OWN_FILTERS for each in filters):
            self.refuse(place, "is packed in a way that only a plug-in knows")
        value_bytes = max(1, data.id.get_type().get_size())
        values, stored = data.id.get_space().get_simple_extent_npoints(), min(data.id.get_storage_size(), self._bytes)
        if values * value_bytes > (MOST_INFLATION if filters else 1) * stored:
            self.refuse(place, f"claims {values} values of {value_bytes} bytes each, and the file holds {stored} bytes of them")
        chunk_bytes = value_bytes * math.prod(made.get_chunk()) if filters and layout == h5py.h5d.CHUNKED else 0
        if chunk_bytes > MOST_CHUNK_BYTES:
            self.refuse(place, f"is packed in chunks of {chunk_bytes} bytes")
