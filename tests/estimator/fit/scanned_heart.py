"""A simulated ventricle from the scanner in a box to Guccione's parameters: all four true values lie in their 95 % intervals.

usage: scanned_heart.py DIASTOLE SOURCE_FOLDER"""

import json
import pathlib
import subprocess
import sys
import tempfile

DIASTOLE, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
TRUTH = {"C_kPa": 3.0, "b1": 11.09, "b2": 1.76, "b3": 10.0}
MESH = ["--mesh", "6,3,1"]


def run(*arguments):
    ended = subprocess.run([DIASTOLE, *map(str, arguments)], capture_output=True, text=True)
    assert ended.returncode == 0, f"diastole {arguments}: exit code {ended.returncode}\n{ended.stderr}"
    return ended.stdout


with tempfile.TemporaryDirectory() as scratch:
    values = [part for name, value in TRUTH.items() for part in ("--set", f"{name}={value}")]
    run("scan", SOURCE / "examples/lv-clean.study.toml", *MESH, *values, "-o", f"{scratch}/heart", "--matrix", 96)
    fit = json.loads(run("fit", f"{scratch}/heart/scan.study.toml", *MESH, "--fibre-sigma-deg", 2, "--geometry-sigma-mm", 0.25,
                         "--json"))
    for name, truth in TRUTH.items():
        found = fit["parameters"][name]
        low, high = found["ci95"]
        assert low < truth < high, f"{name}: {truth} is not in {low} to {high}"
        shares = found["variance_shares"]
        assert abs(sum(shares.values()) - 1) < 1e-9 and all(share > 0 for share in shares.values()), shares
        print(f"{name} = {found['value']:.3f}, 95 % {low:.3f} to {high:.3f}, variance from {shares}")
    assert fit["directions"][0]["relative_sd"] > 5 * fit["directions"][-1]["relative_sd"], "the ridge is reported"
