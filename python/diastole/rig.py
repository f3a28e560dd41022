"""A real or simulated rig, over the daemon's socket (docs/daemon.md): JSON-RPC 2.0, a message a line."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import socket
import stat
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Callable, Union

from diastole.program import DiastoleError
from diastole.run import Run

Path = Union[str, "os.PathLike[str]"]
SERVICE = "/run/diastole/daemon.sock"


@dataclass(frozen=True)
class Sample:
    """A live sample: seconds since the run's start; NaN where it is missing."""

    time_s: float
    kPa: float
    filtered_kPa: float


def default_socket() -> str:
    """The user's own daemon, else the system's service."""
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        own = f"{runtime}/diastole.sock"
    elif os.geteuid() == 0:
        own = "/run/diastole.sock"
    elif os.path.isdir(f"/run/user/{os.geteuid()}"):
        own = f"/run/user/{os.geteuid()}/diastole.sock"
    else:
        state = os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state")
        own = f"{state}/diastole/daemon.sock"
    return SERVICE if not os.path.exists(own) and os.path.exists(SERVICE) else own


def _may_serve(uid: int, path: str) -> bool:
    """Root or this user, or nobody but root and `uid` can put a socket there (host/rpc/peer.hpp)."""
    if uid in (0, os.geteuid()):
        return True
    named = pathlib.Path(os.path.abspath(path))
    for fact in [folder.lstat() for each in (named, named.resolve()) for folder in each.parents]:
        others_write = not stat.S_ISLNK(fact.st_mode) and fact.st_mode & 0o022
        if others_write or fact.st_uid not in (0, uid):
            return False
    return True


class Rig:
    """A client of the daemon. Orders take the control if it is free; leaving a `with` block gives it back."""

    def __init__(self, path: Path | None = None, patience_s: float = 3600) -> None:
        self.path = os.fspath(path) if path is not None else default_socket()
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(patience_s)
        try:
            self._socket.connect(self.path)
        except OSError as error:
            self._socket.close()
            raise DiastoleError(3, f"{self.path}: no daemon listens there ({error.strerror})") from error
        credentials = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
        uid = struct.unpack("3i", credentials)[1]
        if not _may_serve(uid, self.path):
            self._socket.close()
            raise DiastoleError(3, f"{self.path}: user {uid} listens there, and others could: not taken for the daemon")
        self._lines = self._socket.makefile("r", encoding="utf-8")
        self._number = 0

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._lines.close()
        self._socket.close()

    def call(self, method: str, **params: Any) -> Any:
        """One request, one answer; what the daemon refuses raises DiastoleError."""
        self._number += 1
        request = {"jsonrpc": "2.0", "id": self._number, "method": method, "params": params}
        self._socket.sendall((json.dumps(request) + "\n").encode())
        line = self._lines.readline()
        if not line:
            raise DiastoleError(3, f"{self.path}: the daemon has gone")
        answer = json.loads(line)
        if "error" in answer:
            error = answer["error"]
            raise DiastoleError(2 if error["code"] in (-32001, -32602) else 3, error["message"])
        return answer["result"]

    def status(self) -> dict[str, Any]:
        return dict(self.call("rig.status"))

    def home(self) -> dict[str, Any]:
        return dict(self.call("rig.home"))

    def stop(self, at_cycle_end: bool = False) -> bool:
        """Anybody may. False if nothing moved."""
        return bool(self.call("run.stop", how="cycle_end" if at_cycle_end else "now")["stopping"])

    def start(self, experiment: Path, **facts: Any) -> dict[str, Any]:
        """Begins a run and returns at once; facts are specimen, operator, room_temperature_C, notes (a list)."""
        file = pathlib.Path(experiment)
        points = {name.name: name.read_text() for name in file.parent.glob("*.csv") if name.name in file.read_text()}
        return dict(self.call("run.start", experiment=file.read_text(), file=str(file), points=points, session=facts))

    def progress(self) -> dict[str, Any] | None:
        """Of the present or last run: state, triggers, received, missing, last_kPa, result, ...; None before the first."""
        state = self.call("run.progress", first_remark=0)
        return None if state is None else dict(state)

    def live(self, interval_s: float = 0.1) -> Iterator[Sample]:
        """The samples of the present run as they come, from its first that is kept to its end."""
        row, run_id = 0, ""
        while True:
            state = self.progress()
            trace = self.call("run.trace", run_id=run_id, first_row=row, first_trigger=0)
            run_id, row = trace["run_id"], trace["first_row"] + len(trace["time_s"])
            for values in zip(trace["time_s"], trace["kPa"], trace["filtered_kPa"]):
                yield Sample(*(float("nan") if value is None else value for value in values))
            if trace["time_s"]:
                continue
            if state is None or state["state"] in ("done", "failed"):
                return
            time.sleep(interval_s)

    def run(self, experiment: Path, output: Path, progress: Callable[[dict[str, Any]], None] = lambda _: None, **facts: Any) -> Run:
        """A whole session; returns its run file. An interrupt (Ctrl-C) stops at the cycle's end and keeps what was recorded."""
        if os.path.exists(output):
            raise FileExistsError(f"{output} exists already")
        self.start(experiment, **facts)
        while True:
            try:
                state = self.progress() or {}
                progress(state)
                if state["state"] in ("done", "failed"):
                    break
                time.sleep(0.1)
            except KeyboardInterrupt:
                self.stop(at_cycle_end=True)
        result = state["result"]
        if "run_file" not in result:
            raise DiastoleError(3, f"{result.get('problem')}\n  What was recorded is in {result.get('journal')}: diastole recover")
        part = f"{os.fspath(output)}.part"
        shutil.copyfile(result["run_file"], part)
        os.replace(part, output)
        return Run(output)
