"""Run files that somebody has tampered with: each is refused with its place, in little memory, and touches no other file.

hostile_run_files.py DIASTOLE SOURCE_DIR
"""

import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import zlib

import h5py
import numpy as np

MOST_MEMORY = 600 << 20  # of address space: program, libraries and what a run of seconds needs
HUGE = 100_000_000
MEGABYTE = "x" * (1 << 20)
CHUNK_ROWS = 1 << 17
IN_SUM = "MB of memory with what was read before it"


def external_link(run, place):
    with h5py.File(place / "other.h5", "w") as other:
        other["secret"] = np.arange(1000.0)
    del run["trigger/time_s"]
    run["trigger/time_s"] = h5py.ExternalLink("other.h5", "/secret")
    return "link /trigger/time_s"


def external_group(run, place):
    with h5py.File(place / "other.h5", "w") as other:
        other.create_group("elsewhere")
    run["flow"] = h5py.ExternalLink("other.h5", "/elsewhere")
    return "link /flow"


def user_defined_link(run, place):
    """A link of a class that nobody has registered; the library's own number for an external one is overwritten."""
    run.create_group("more")["zz"] = h5py.ExternalLink("name-to-be-found-again.h5", "/x")  # of few links, which bear no checksum
    return "link /more/zz"


def damaged_group(run, place):
    """As the last, among many links, whose checksum then is wrong."""
    run["zz"] = h5py.ExternalLink("name-to-be-found-again.h5", "/x")
    return "groups that cannot be read"


def external_storage(run, place):
    (place / "passwords.raw").write_bytes(bytes(8 * 1000))
    del run["pump/time_s"]
    run.create_dataset("pump/time_s", (1000,), "f8", external=[(str(place / "passwords.raw"), 0, h5py.h5f.UNLIMITED)])
    return "dataset /pump/time_s"


def virtual_dataset(run, place):
    with h5py.File(place / "other.h5", "w") as other:
        other["secret"] = np.arange(1000.0)
    layout = h5py.VirtualLayout((1000,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "secret", (1000,))
    del run["pump/time_s"]
    run.create_virtual_dataset("pump/time_s", layout)
    return "dataset /pump/time_s"


def rows_that_are_not_there(run, place):
    del run["pressure/time_s"]
    run.create_dataset("pressure/time_s", (HUGE,), "f8")
    return "dataset /pressure/time_s"


def chunks_that_are_not_there(run, place):
    del run["pressure/time_s"]
    run.create_dataset("pressure/time_s", (HUGE,), "f8", chunks=(4096,), compression="gzip", shuffle=True)
    return "dataset /pressure/time_s"


def one_chunk_that_unpacks_to_much(run, place):
    values = run["pressure/cavity_kPa"][:]
    del run["pressure/cavity_kPa"]
    data = run.create_dataset("pressure/cavity_kPa", values.shape, "f8", maxshape=(None,), chunks=(60_000_000,), compression="gzip")
    data.attrs["units"] = "kPa"
    data.id.write_direct_chunk((0,), zlib.compress(values.tobytes() + bytes(8 * (60_000_000 - len(values))), 1))
    return "dataset /pressure/cavity_kPa: is packed in chunks of 480000000 bytes"


def more_triggers_than_any_recording_has(run, place):
    del run["trigger/time_s"]
    data = run.create_dataset("trigger/time_s", (HUGE,), "f8", chunks=(1 << 20,), compression="gzip")
    chunk = zlib.compress(bytes(8 << 20), 1)
    for first in range(0, HUGE, 1 << 20):
        data.id.write_direct_chunk((first,), chunk)
    return "dataset /trigger/time_s: claims 100000000 rows"


def table_that_is_not_there(run, place):
    row = run["events"].dtype
    del run["events"]
    run.create_dataset("events", (HUGE // 10,), row, chunks=(4096,))
    return "dataset /events"


def of_one_text(run, table, first_row):
    """A table of many rows; after() makes each the first, so that their variable-length texts are the same megabyte."""
    texts = h5py.string_dtype()
    row = [(name, texts if isinstance(value, str) else type(value)) for name, value in first_row.items()]
    del run[table]
    data = run.create_dataset(table, (4000,), row)
    data[0] = tuple(first_row.values())
    run.flush()


def one_text_many_times(run, place):
    of_one_text(run, "gaps", {"stream": MEGABYTE, "first_index": 0, "count": 1, "reason": MEGABYTE})
    return "dataset /gaps"


def one_waveform_many_times(run, place):
    of_one_text(run, "protocol/segments", {"start_s": 0.0, "waveform": MEGABYTE, "stroke_mL": 1.0, "period_s": 1.0, "offset_mL": 0.0, "cycles": 1})
    return "has texts of more than"


def text_of_a_fixed_length(run, place):
    del run["protocol/toml"]
    run.create_dataset("protocol/toml", (), "S268000000")
    return "dataset /protocol/toml"


def set_of_numbers_in_two_dimensions(run, place):
    del run["trigger/time_s"]
    run.create_dataset("trigger/time_s", (1 << 20, 1 << 20), "f8", chunks=(64, 64))
    return "dataset /trigger/time_s"


def a_type_of_its_own(run, place):
    del run["pump/commanded_mL"]
    run.create_dataset("pump/commanded_mL", (10,), h5py.opaque_dtype(np.dtype("V8")))
    return "dataset /pump/commanded_mL"


def of_zeros(group, name, rows, row="f8"):
    """Many rows in few bytes: a kilobyte for each megabyte."""
    data = group.create_dataset(name, (rows,), row, chunks=(CHUNK_ROWS,), compression="gzip")
    chunk = zlib.compress(bytes(CHUNK_ROWS * data.dtype.itemsize))
    for first in range(0, rows, CHUNK_ROWS):
        data.id.write_direct_chunk((first,), chunk)
    return data


def one_dataset_as_every_flow(run, place):
    rows = np.repeat(run["protocol/segments"][:], 1000)
    kind = run["protocol/segments"].dtype
    del run["protocol/segments"]
    run.create_dataset("protocol/segments", data=rows, dtype=kind)
    zeros = of_zeros(run, "zeros", CHUNK_ROWS)
    for segment in range(1000):
        for name in ("phase_s", "cavity_mL", "sigma_mL"):
            run[f"mr/flow/{segment}/{name}"] = zeros
    return IN_SUM


def flow_of_no_segment(run, place):
    for name in ("phase_s", "cavity_mL", "sigma_mL"):
        run[f"mr/flow/1/{name}"] = np.arange(10.0)
    return "group /mr/flow/1: is of a segment"


def waveform_of_no_segment(run, place):
    run["protocol/waveforms/1/points"] = "phase,fraction"
    for name in ("phase", "fraction"):
        run[f"protocol/waveforms/1/{name}"] = np.arange(10.0)
    return "group /protocol/waveforms/1: is of a segment"


def one_dataset_as_many_channels(run, place):
    del run["pressure/cavity_kPa"]
    zeros = of_zeros(run, "pressure/cavity_kPa", 1 << 22)
    for i in range(100):
        run[f"pressure/p{i}_kPa"] = zeros
    return IN_SUM


def more_channels_than_an_instrument_has(run, place):
    for i in range(300):
        run[f"pressure/p{i}_kPa"] = run["pressure/cavity_kPa"]
    return "group /pressure: has more than 256 channels"


def channels_of_large_chunks(run, place):
    """Of each of which two would be kept."""
    rows = 1 << 21
    for name in list(run["pressure"]):
        del run["pressure"][name]
    run.create_dataset("pressure/time_s", data=np.arange(rows) / 1024, chunks=(CHUNK_ROWS,), compression="gzip", shuffle=True)
    chunk = zlib.compress(bytes(8 * rows))
    for name in ["cavity_kPa"] + [f"p{i}_kPa" for i in range(40)]:
        data = run.create_dataset(f"pressure/{name}", (rows,), "f8", chunks=(rows,), compression="gzip")
        data.id.write_direct_chunk((0,), chunk)
    return IN_SUM


def long_notes_on_every_channel(run, place):
    cavity = run["pressure/cavity_kPa"]
    cavity.attrs["first"], cavity.attrs["second"] = MEGABYTE, MEGABYTE
    for i in range(250):
        run[f"pressure/p{i}_kPa"] = cavity
    return IN_SUM


def of_many_rows(run, table):
    kinds = run[table].dtype
    row = np.dtype([(name, "S1" if kinds[name].kind in "OS" else kinds[name]) for name in kinds.names])
    del run[table]
    of_zeros(run, table, 1 << 24, row)
    return f"dataset /{table}: needs"


def events_that_unpack_to_many(run, place):
    return of_many_rows(run, "events")


def gaps_that_unpack_to_many(run, place):
    return of_many_rows(run, "gaps")


def triggers_that_unpack_to_many(run, place):
    del run["trigger/time_s"]
    run.create_dataset("trigger/time_s", data=np.arange(1 << 22) / (1 << 20), chunks=(CHUNK_ROWS,), compression="gzip", shuffle=True)
    return "dataset /trigger/time_s: needs"


def after(file, tampered):
    """What h5py itself cannot write, put into the finished file's bytes."""
    content = file.read_bytes()
    if tampered in (user_defined_link, damaged_group):
        # In a link message the link's class stands before its character set and its name: an external one's is 64; 200 is free.
        name = content.rfind(b"zz", 0, content.find(b"name-to-be-found-again.h5"))
        kind = content.rfind(b"\x40", name - 4, name)
        if name < 0 or kind < 0:
            return False
        content = content[:kind] + bytes([200]) + content[kind + 1:]
    if tampered in (one_text_many_times, one_waveform_many_times):
        with h5py.File(file, "r") as run:
            data = run["gaps" if tampered is one_text_many_times else "protocol/segments"]
            begin, bytes_all, rows = data.id.get_offset(), data.id.get_storage_size(), data.shape[0]
        one = content[begin:begin + bytes_all // rows]
        content = content[:begin] + one * rows + content[begin + bytes_all:]
    file.write_bytes(content)
    return True


HOSTILE = [external_link, external_group, user_defined_link, damaged_group, external_storage, virtual_dataset, rows_that_are_not_there,
           chunks_that_are_not_there, one_chunk_that_unpacks_to_much, more_triggers_than_any_recording_has, table_that_is_not_there, one_text_many_times,
           one_waveform_many_times, text_of_a_fixed_length,
           set_of_numbers_in_two_dimensions, a_type_of_its_own]
# What a reader takes of the whole file, or of objects that stand for each other: no fault of one that is asked for alone.
HOSTILE_IN_SUM = [one_dataset_as_every_flow, flow_of_no_segment, waveform_of_no_segment, one_dataset_as_many_channels,
                  more_channels_than_an_instrument_has, channels_of_large_chunks, long_notes_on_every_channel, events_that_unpack_to_many,
                  gaps_that_unpack_to_many, triggers_that_unpack_to_many]


def limited():
    if os.environ.get("DIASTOLE_SANITIZED"):
        return  # which takes terabytes of address space
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))


def main():
    diastole, source = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    place = pathlib.Path(tempfile.mkdtemp(prefix="diastole-hostile-"))
    try:
        sound = place / "sound.run.h5"
        subprocess.run([diastole, "simulate", str(source / "examples/gel.experiment.toml"), "-o", str(sound)], check=True,
                       cwd=place, capture_output=True)
        sane = subprocess.run([diastole, "inspect", str(sound)], cwd=place, capture_output=True, text=True,
                              preexec_fn=limited)
        assert sane.returncode == 0, f"the run itself is not read in {MOST_MEMORY >> 20} MB: {sane.stderr}"
        failures = []
        for tampered in HOSTILE + HOSTILE_IN_SUM:
            file = place / "hostile.run.h5"
            shutil.copy(sound, file)
            with h5py.File(file, "r+") as run:
                expected = tampered(run, place)
            if not after(file, tampered):
                failures.append(f"{tampered.__name__}: this test could not make it")
                continue
            for command in (["inspect", str(file)], ["note", str(file), "a word"], ["catheter", str(file)]):
                before = file.read_bytes()
                ended = subprocess.run([diastole, *command], cwd=place, capture_output=True, text=True, preexec_fn=limited,
                                       timeout=60)
                if ended.returncode != 2 or expected not in ended.stderr:
                    failures.append(f"{tampered.__name__}, {command[0]}: exit code {ended.returncode}, "
                                    f"expected 2 and '{expected}'; said: {ended.stderr.strip()[:300]}")
                if file.read_bytes() != before:
                    failures.append(f"{tampered.__name__}, {command[0]}: the file was changed")
        print(f"{len(HOSTILE + HOSTILE_IN_SUM)} hostile files")
        sys.exit("\n".join(failures) if failures else 0)
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    main()
