"""Reads a run file with h5py and checks every promise of docs/run-file.md. Exit status 1 tells the first broken one."""
import sys

import h5py
import numpy as np

file = h5py.File(sys.argv[1], "r")


def check(condition, words):
    if not condition:
        sys.exit(f"broken: {words}")


check(file.attrs["format"] == "diastole-run", "format")
check(file.attrs["format_version"] == 1, "format_version")
for name in ("run_id", "started_utc", "producer"):
    check(isinstance(file.attrs[name], str) and file.attrs[name], name)
check(file["rig"].attrs["bore_mm"] == 100.0, "rig attribute bore_mm")
check(isinstance(file["protocol/toml"][()].decode(), str), "protocol/toml is text")
check(file["protocol/segments"].dtype.names == ("start_s", "waveform", "stroke_mL", "period_s", "offset_mL", "cycles"),
      "columns of segments")
check(file["gaps"].dtype.names == ("stream", "first_index", "count", "reason"), "columns of gaps")
check(file["events"].dtype.names == ("time_s", "level", "code", "text"), "columns of events")

units = {"pump/time_s": "s", "pump/commanded_mL": "mL", "pressure/time_s": "s", "pressure/cavity_kPa": "kPa",
         "pressure/cavity_filtered_kPa": "kPa",
         "trigger/time_s": "s"}
for path, unit in units.items():
    check(file[path].dtype == np.float64, f"{path} is float64")
    check(file[path].attrs["units"] == unit, f"units of {path}")


def has_units(path, thing):
    if isinstance(thing, h5py.Dataset):
        check("units" in thing.attrs, f"{path} has no units")


file.visititems(has_units)
for path in ("pump/time_s", "pressure/time_s", "trigger/time_s"):
    check(np.all(np.diff(file[path][:]) > 0), f"{path} increases")
check(len(file["pump/time_s"]) == len(file["pump/commanded_mL"]), "pump datasets equally long")
check(1 / np.median(np.diff(file["pump/time_s"][:])) > 299.9, "pump at 300 Hz or finer")

pressure = file["pressure/cavity_kPa"][:]
declared = np.zeros(len(pressure), bool)
for gap in file["gaps"][:]:
    if gap["stream"].decode() == "pressure":
        declared[gap["first_index"]:gap["first_index"] + gap["count"]] = True
filtered = file["pressure/cavity_filtered_kPa"]
check(filtered.attrs["cutoff_Hz"] == 30.0 and filtered.attrs["delay_s"] == 0.0, "notes of the filtered pressure")
check(np.array_equal(np.isnan(filtered[:]), declared), "the filtered pressure has the same gaps")
check(np.array_equal(np.isnan(pressure), declared), "NaN exactly where a gap is declared")
