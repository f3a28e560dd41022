"""Reads an exported recording as BIDS describes it, with nothing but Python's own modules, and compares it with the run
file. Exit status 1 tells the first difference."""
import gzip
import json
import math
import sys

import h5py
import numpy as np

run = h5py.File(sys.argv[1], "r")
description = json.load(open(sys.argv[2] + ".json", encoding="utf-8"))
rows = [line.rstrip("\n").split("\t") for line in gzip.open(sys.argv[2] + ".tsv.gz", "rt", encoding="utf-8")]


def check(condition, words):
    if not condition:
        sys.exit(f"broken: {words}")


columns = description["Columns"]
check(all(len(row) == len(columns) for row in rows), "every row has as many cells as there are columns")
table = {name: np.array([math.nan if row[i] == "n/a" else float(row[i]) for row in rows])
         for i, name in enumerate(columns)}
for name in columns:
    check({"Description", "Units"} <= description[name].keys(), f"{name} is described")

time_s = run["pressure/time_s"][:]
triggers_s = run["trigger/time_s"][:]
start_s, rate_Hz = description["StartTime"], description["SamplingFrequency"]
stated_s = triggers_s[0] + start_s + np.arange(len(rows)) / rate_Hz
check(len(rows) == len(time_s), "one row a sample")
check(np.max(np.abs(stated_s - time_s)) < 2 / rate_Hz, "rows are where StartTime and SamplingFrequency say")
for name in run["pressure"]:
    if name == "time_s":
        continue
    raw = run["pressure"][name][:]
    check(np.array_equal(np.isnan(raw), np.isnan(table[name])), f"{name}: n/a exactly where a sample is missing")
    check(np.nanmax(np.abs(raw - table[name])) < 1e-4, f"{name}: values")
    check(description[name]["Units"] == "kPa", f"{name}: unit")
check(np.sum(table["trigger"]) == len(triggers_s), "as many triggers as edges")
check(np.max(np.abs(stated_s[table["trigger"] == 1] - triggers_s)) < 2 / rate_Hz, "triggers where the edges are")
expected_mL = np.interp(time_s, run["pump/time_s"][:], run["pump/commanded_mL"][:])
check(np.nanmax(np.abs(expected_mL - table["commanded_mL"])) < 1e-3, "commanded volume")
