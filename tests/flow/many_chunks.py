"""A run file of as many chunks as an hour of ten channels at 10 kHz has is read in little more memory than one of seconds.

many_chunks.py DIASTOLE SOURCE_DIR
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zlib

import h5py
import numpy as np

CHANNELS, CHUNKS, CHUNK_ROWS = 10, 9000, 64  # real chunks have 4096 rows; of them only the number counts here
MOST_GROWTH_MB = 8


def make_long(run):
    """Replaces the pressure's rows by many chunks, of each channel all alike."""
    rows = CHUNKS * CHUNK_ROWS
    pressure = run["pressure"]
    for name in list(pressure):
        del pressure[name]
    pressure.attrs["grid_start_s"], pressure.attrs["grid_end_s"], pressure.attrs["grid_rate_Hz"] = 0.0, rows / 1e4, 1e4
    for channel in ["time_s", "cavity_kPa"] + [f"p{i}_kPa" for i in range(1, CHANNELS)]:
        data = pressure.create_dataset(channel, (rows,), "f8", chunks=(CHUNK_ROWS,), maxshape=(None,), compression="gzip")
        data.attrs["units"] = "s" if channel == "time_s" else "kPa"
        alike = zlib.compress(np.linspace(0, 1, CHUNK_ROWS).tobytes(), 1)
        for first in range(0, rows, CHUNK_ROWS):
            times = (first + np.arange(CHUNK_ROWS)) / 1e4
            data.id.write_direct_chunk((first,), zlib.compress(times.tobytes(), 1) if channel == "time_s" else alike)


def peak_MB(command, folder):
    """Of the command itself, which reports problems of the run, and so may end with 1."""
    measured = f"import resource, subprocess, sys; code = subprocess.run({command!r}, stdout=subprocess.DEVNULL).returncode\n" \
               "print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    code, kB = subprocess.run([sys.executable, "-B", "-c", measured], cwd=folder, capture_output=True, text=True, check=True).stdout.split()
    assert int(code) in (0, 1), f"{command} ended with {code}"
    return int(kB) / 1000


def main():
    if os.environ.get("DIASTOLE_SANITIZED"):
        print("skipped: sanitizers keep freed memory")
        sys.exit(77)
    diastole, source = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="diastole-chunks-"))
    try:
        short, long = folder / "short.run.h5", folder / "long.run.h5"
        subprocess.run([diastole, "simulate", str(source / "examples/gel.experiment.toml"), "-o", str(short)], check=True,
                       cwd=folder, capture_output=True)
        shutil.copy(short, long)
        with h5py.File(long, "r+") as run:
            make_long(run)
        peaks = [peak_MB([diastole, "inspect", str(file), "--json"], folder) for file in (short, long)]
        print(f"{peaks[0]:.1f} MB of seconds, {peaks[1]:.1f} MB of {CHUNKS} chunks a channel")
        if peaks[1] - peaks[0] > MOST_GROWTH_MB:
            sys.exit(f"memory grows by more than {MOST_GROWTH_MB} MB with a run's chunks")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
