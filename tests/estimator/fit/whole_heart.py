"""examples/heart whole: made, measured, fitted; what is found is held against the truth that it was made of.

usage: whole_heart.py DIASTOLE SOURCE_FOLDER [SEED]"""

import csv
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import tomllib

DIASTOLE, SOURCE = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
SEED = sys.argv[3] if len(sys.argv) > 3 else "1"
EXAMPLE = SOURCE / "examples/heart"
CHI_SQUARE_95 = 9.488  # of four freedoms


def run(*command):
    path = f"{DIASTOLE.parent}:{os.environ['PATH']}"
    ended = subprocess.run([str(part) for part in command], capture_output=True, text=True, env={**os.environ, "PATH": path})
    assert ended.returncode == 0, f"{command}: exit code {ended.returncode}\n{ended.stderr}"
    return ended.stdout


def solved(matrix, right):
    """By elimination with pivots."""
    rows = [[*row, value] for row, value in zip(matrix, right)]
    for k in range(len(rows)):
        best = max(range(k, len(rows)), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(len(rows)):
            if i != k:
                share = rows[i][k] / rows[k][k]
                rows[i] = [a - share * b for a, b in zip(rows[i], rows[k])]
    return [row[-1] / row[k] for k, row in enumerate(rows)]


def chi_square(fit, truth):
    """Of all four together, in logarithms: the fit's own coordinates."""
    names = fit["correlation"]["names"]
    places = [names.index(name) for name in truth]
    of = [fit["parameters"][name] for name in truth]
    miss = [math.log(true / found["value"]) for true, found in zip(truth.values(), of)]
    sd = [found["se"] / found["value"] for found in of]
    covariance = [[sd[i] * sd[k] * fit["correlation"]["matrix"][a][b] for k, b in enumerate(places)] for i, a in enumerate(places)]
    return sum(a * b for a, b in zip(miss, solved(covariance, miss)))


def table(file):
    with open(file, newline="") as rows:
        return [{name: float(value) if value else None for name, value in row.items()} for row in csv.DictReader(rows)]


with tempfile.TemporaryDirectory() as scratch:
    heart = pathlib.Path(scratch) / "heart"
    run(EXAMPLE / "make", heart, "--seed", SEED)
    refused = subprocess.run([EXAMPLE / "make", heart], capture_output=True, text=True)
    assert refused.returncode == 2 and "is there already" in refused.stderr, refused

    true_study = tomllib.loads((EXAMPLE / "truth.study.toml").read_text())
    truth = {name: law["start"] for name, law in true_study["law"]["parameters"].items()}
    stroke_mL = tomllib.loads((EXAMPLE / "heart.experiment.toml").read_text())["segment"][0]["stroke_mL"]
    volumes = [row["volume_mL"] for row in table(heart / "heart.loop.csv")]
    swing_mL = max(volumes) - min(volumes)
    with open(heart / "heart.guide.csv", newline="") as guide:
        base_mm = statistics.mean(float(row["z_mm"]) for row in csv.DictReader(guide) if row["surface"] == "base")
    base_mm -= true_study["specimen"]["base_z_mm"] + true_study["images"]["to_specimen"]["origin_mm"][2]
    print(f"volume swings by {swing_mL:.2f} mL of {stroke_mL}; the base is found {base_mm:+.2f} mm beside its place")
    assert abs(swing_mL - stroke_mL) < 0.02 * stroke_mL, "phase contrast shows the stroke"
    assert abs(base_mm) < 0.15, "the cines show the base"

    def fitted(study, *options):
        fit = json.loads(run("diastole", "fit", study, "--energy", heart / "heart.loop.csv", "--pressure-offset", "0.05", *options, "--json"))
        for name, true in truth.items():
            found = fit["parameters"][name]
            low, high = found["ci95"]
            print(f"{name} = {found['value']:.3f}, 95 % {low:.3f} to {high:.3f}, variance from {found['variance_shares']}")
            assert low < true < high, f"{name}: {true} is not in {low} to {high}"
            assert abs(sum(found["variance_shares"].values()) - 1) < 1e-9, found
        together = chi_square(fit, truth)
        print(f"chi-square of all four {together:.2f}, of the data {fit['chi2_per_dof']:.2f} a freedom")
        assert together < CHI_SQUARE_95, "all four lie in their joint 95 % region"
        assert fit["chi2_per_dof"] < 1.5, "the model is that of the images"
        return fit

    # As measured: the shares of all four sources, and a ridge.
    fit = fitted(heart / "heart.study.toml", "--fibre-sigma-deg", "2", "--geometry-sigma-mm", "0.25")
    other = pathlib.Path(scratch) / "other"
    run(EXAMPLE / "make", other, "--seed", "2", "--unmeasured")
    of_other = json.loads(run("diastole", "track", other / "dicom", "-o", other / "heart.tags.csv", "--json"))["problems"]
    for findings in json.loads(next(heart.glob("*.tracking.json")).read_text())["findings"], of_other:
        lost = [finding for finding in findings if finding["id"] == "not-tracked"]
        assert not lost, f"tags are followed in every slice, whatever the noise: {lost}"
    # Nine tenths of b2's variance are the fibres' two degrees, along the ridge; what images, pressures and walls leave is small.
    for name, most in {"C_kPa": 4, "b1": 4, "b2": 5, "b3": 4}.items():
        found = fit["parameters"][name]
        assert found["ci95"][1] < most * found["ci95"][0], f"{name}: {found} says nothing"
        left = found["se"] / found["value"] * math.sqrt(1 - found["variance_shares"]["fibres"])
        assert left < 0.15, f"{name}: {left} without the fibres' error"
    for found in fit["parameters"].values():
        shares = found["variance_shares"]
        assert set(shares) == {"images", "pressures", "fibres", "geometry"} and all(share > 0 for share in shares.values()), shares
    assert fit["directions"][0]["relative_sd"] > 5 * fit["directions"][-1]["relative_sd"], "the ridge is reported"

    # With the true shape and fibres the same images tell a few per cent.
    elsewhere = [part for name, value in {"C_kPa": 2, "b1": 15, "b2": 3, "b3": 6}.items() for part in ("--set", f"{name}={value}")]
    exact = fitted(heart / "truth/exact.study.toml", *elsewhere)
    true_kPa = {row["frame"]: row["pressure_kPa"] for row in table(heart / "truth/truth.frames.csv")}
    print("tags lie where so many kPa more would move them, frame by frame:",
          *(f"{frame['estimated_kPa'] - true_kPa[frame['frame']]:+.3f}" for frame in exact["frames"]))
    for name, found in exact["parameters"].items():
        assert found["se"] < 0.05 * found["value"], f"{name}: {found}"
