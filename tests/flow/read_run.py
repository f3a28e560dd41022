#!/usr/bin/python3
"""Reads a run file with h5py alone and checks it against the documented layout; prints what it found as JSON."""

import json
import sys

import h5py
import numpy as np


def check(run):
    attributes = run.attrs
    assert attributes["format"] == "diastole-run", attributes["format"]
    assert attributes["format_version"] == 1, attributes["format_version"]
    for name in ("run_id", "started_utc", "producer"):
        assert isinstance(attributes[name], str) and attributes[name], name
    rig = run["rig"].attrs
    for name in ("bore_mm", "screw_rev_per_cm", "steps_per_rev", "hose_length_m", "hose_bore_mm",
                 "fluid_density_kg_m3", "fluid_viscosity_Pa_s", "catheter_length_m"):
        assert np.isfinite(rig[name]), name
    toml = run["protocol/toml"][()]
    assert b"diastole-experiment" in (toml if isinstance(toml, bytes) else toml.encode())
    segments = run["protocol/segments"]
    for field in ("start_s", "waveform", "stroke_mL", "period_s", "offset_mL", "cycles"):
        assert field in segments.dtype.names, field
    without_units = []
    run.visititems(lambda path, item: without_units.append(path)
                   if isinstance(item, h5py.Dataset) and not item.attrs.get("units") else None)
    assert not without_units, without_units
    columns = {}
    for path, unit in (("pump/time_s", "s"), ("pump/commanded_mL", "mL"), ("pressure/time_s", "s"),
                       ("pressure/cavity_kPa", "kPa"), ("trigger/time_s", "s")):
        dataset = run[path]
        assert dataset.dtype == np.float64, path
        assert dataset.attrs["units"] == unit, path
        columns[path] = dataset[:]
    for path in ("pump/time_s", "pressure/time_s", "trigger/time_s"):
        assert np.all(np.diff(columns[path]) > 0), path
    assert len(columns["pump/time_s"]) == len(columns["pump/commanded_mL"])
    assert len(columns["pressure/time_s"]) == len(columns["pressure/cavity_kPa"])
    for field in ("stream", "first_index", "count", "reason"):
        assert field in run["gaps"].dtype.names, field
    for field in ("time_s", "level", "code", "text"):
        assert field in run["events"].dtype.names, field
    waveforms = {}
    for segment, group in run.get("protocol/waveforms", {}).items():
        points = group["points"][()]
        waveforms[segment] = {"points": points.decode() if isinstance(points, bytes) else points,
                              "phase": group["phase"][:].tolist(), "fraction": group["fraction"][:].tolist()}
    pressure_time_s = columns["pressure/time_s"]
    return {
        "samples": len(pressure_time_s),
        "rate_Hz": (len(pressure_time_s) - 1) / (pressure_time_s[-1] - pressure_time_s[0]),
        "first_s": pressure_time_s[0],
        "last_s": pressure_time_s[-1],
        "triggers_s": columns["trigger/time_s"].tolist(),
        "peak_kPa": float(np.nanmax(columns["pressure/cavity_kPa"])),
        "missing": int(np.isnan(columns["pressure/cavity_kPa"]).sum()),
        "gap_counts": [int(row["count"]) for row in run["gaps"][:]],
        "peak_commanded_mL": float(columns["pump/commanded_mL"].max()),
        "pump_interval_s": float(np.max(np.diff(columns["pump/time_s"]))),
        "waveforms": waveforms,
        "segment_start_s": segments["start_s"].tolist(),
        "pump_time_s": columns["pump/time_s"].tolist(),
        "commanded_mL": columns["pump/commanded_mL"].tolist(),
        "events": [row["code"].decode() if isinstance(row["code"], bytes) else row["code"]
                   for row in run["events"][:]],
    }


if __name__ == "__main__":
    with h5py.File(sys.argv[1], "r") as file:
        print(json.dumps(check(file)))
