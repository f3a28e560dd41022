"""Makes every command say its --json document, on small inputs, and hands them on: `for command, document in documents(...)`."""

import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess

import h5py
import numpy as np

SLOW = {"explain", "reference"}  # fits of whole sessions


class Place:
    """A folder of its own in which commands run, as a newcomer's would."""

    def __init__(self, folder, programs, source):
        self.folder, self.programs = pathlib.Path(folder), pathlib.Path(programs)
        self.firmware = pathlib.Path(source) / "build/firmware"
        os.symlink(pathlib.Path(source) / "examples", self.folder / "examples")
        (self.folder / "tests").mkdir()
        os.symlink(pathlib.Path(source) / "tests/data", self.folder / "tests/data")
        self.skipped = []  # what this machine lacks something for
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder / "cache"))

    def run(self, line, codes=(0,)):
        """The document of `diastole LINE --json`."""
        arguments = [str(self.programs / "diastole"), *line.split(), "--json"]
        ended = subprocess.run(arguments, cwd=self.folder, env=self.environment, capture_output=True, text=True)
        assert ended.returncode in codes, f"diastole {line}: exit code {ended.returncode}\n{ended.stderr}"
        return json.loads(ended.stdout)

    def start(self, *arguments, until):
        """A program that goes on; returns it with what it said, once that holds `until`."""
        program = subprocess.Popen([str(self.programs / arguments[0]), *arguments[1:]], cwd=self.folder,
                                   env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = ""
        while until not in said:
            line = program.stdout.readline()
            assert line, f"{arguments[0]} ended: {said}"
            said += line
        return program, said


def end(program):
    program.send_signal(signal.SIGTERM)
    program.communicate()


def make_pop_test(source, target):
    """A run whose pressure is a step through a catheter of 25 Hz, damping ratio 0.3, for `diastole catheter`."""
    shutil.copy(source, target)
    f0_Hz, zeta = 25.0, 0.3
    with h5py.File(target, "r+") as run:
        time_s = run["pressure/time_s"][:]
        since_s = time_s - time_s[len(time_s) // 2] - 1e-4
        fast, slow = 2 * np.pi * f0_Hz * np.sqrt(1 - zeta**2), 2 * np.pi * f0_Hz * zeta
        ringing = np.exp(-slow * since_s.clip(0)) * (np.cos(fast * since_s) + slow / fast * np.sin(fast * since_s))
        noise_kPa = 0.002 * np.random.default_rng(1).standard_normal(len(time_s))
        run["pressure/cavity_kPa"][:] = noise_kPa + np.where(since_s > 0, 5 * (1 - ringing), 0)
        if "cavity_filtered_kPa" in run["pressure"]:
            del run["pressure/cavity_filtered_kPa"]


def make_diffusion(folder, axes):
    """NIfTI around a ventricle, its fibres around its axis, b 1000 in twelve directions, for `diastole fibres`."""
    folder.mkdir()
    size, step_mm = (28, 28, 16), np.array([3.0, 3.0, 6.0])
    turn = np.array([axes["x"], axes["y"], axes["z_apex_to_base"]]).T
    first_mm = axes["origin_mm"] - turn @ (step_mm * size / 2)
    place = np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), -1) * step_mm - step_mm * size / 2
    fibre = np.cross([0, 0, 1], place) @ turn.T
    fibre /= np.linalg.norm(fibre, axis=-1, keepdims=True) + 1e-9
    z, around = (np.arange(12) + 0.5) / 12, 2.399963 * np.arange(12)
    towards = np.stack([np.sqrt(1 - z**2) * np.cos(around), np.sqrt(1 - z**2) * np.sin(around), z], -1)
    signals = [np.full(size, 1000.0)] + [1000 * np.exp(-0.8 - 0.5 * (fibre @ g) ** 2) for g in towards]
    signals = np.stack(signals, -1) + 30 * np.random.default_rng(1).standard_normal((*size, 13))
    to_ras = np.diag([-1.0, -1.0, 1.0])
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 4, *size, 13, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 16, 32)  # float
    struct.pack_into("<8f", header, 76, 1, *step_mm, 1, 0, 0, 0)
    struct.pack_into("<2f", header, 108, 352, 1)
    struct.pack_into("<2h", header, 252, 0, 1)  # sform
    struct.pack_into("<12f", header, 280, *np.column_stack([to_ras @ turn * step_mm, to_ras @ first_mm]).ravel())
    header[344:347] = b"n+1"
    (folder / "dwi.nii").write_bytes(bytes(header) + signals.astype("<f4").tobytes(order="F"))
    image = towards @ turn * [-1, 1, 1]  # FSL's convention for right-handed axes
    (folder / "dwi.bval").write_text("0" + " 1000" * 12)
    (folder / "dwi.bvec").write_text("\n".join("0 " + " ".join(map(str, row)) for row in image.T))


def make_pressure(folder):
    """Ten cycles of 1.2 s with their triggers, as tables for `diastole flow`."""
    time_s = np.arange(1300) / 100
    np.savetxt(folder / "pressure.csv", np.column_stack([time_s, 0.25 - 0.25 * np.cos(2 * np.pi * time_s / 1.2)]),
               "%.4f", ",", header="time_s,cavity_kPa", comments="")
    np.savetxt(folder / "trigger.csv", 1.2 * np.arange(10), "%.4f", header="time_s", comments="")


def of_files(place):
    """Commands that read and write files."""
    gel = "examples/phantom-a.study.toml"
    points = "examples/phantom-a-points.study.toml --mesh 4,2,1"
    said = "--specimen gel-7 --operator Jo --room-temperature-C 21.5"
    yield "simulate", place.run(f"simulate examples/gel.experiment.toml -o gel.run.h5 {said} --note first")
    yield "simulate", place.run("simulate examples/gel.experiment.toml -o other.run.h5 --seed 7")
    yield "inspect", place.run("inspect gel.run.h5")
    yield "inspect", place.run("inspect examples/paper-gap/paper-gap.run.h5", (0, 1))
    yield "note", place.run("note gel.run.h5 warm")
    yield "note", place.run("note other.run.h5")
    yield "bin", place.run("bin gel.run.h5 --frames 8")
    yield "export", place.run("export gel.run.h5 --bids bids")
    yield "export", place.run("export gel.run.h5 --ro-crate crate --bids crate")
    yield "compare", place.run("compare gel.run.h5 other.run.h5 -o compared.html")
    yield "compare", place.run("compare gel.run.h5 examples/paper-gap/paper-gap.run.h5")
    yield "replay", place.run("replay gel.run.h5", (0, 1))
    wanted = "examples/shape/ventricle.csv --study examples/shape/gel.study.toml --cycles 9"
    yield "shape", place.run(f"shape {wanted} -o drive.csv --page drive.html")
    yield "shape", place.run(f"simulate --shape {wanted} --iterations 1 -o followed.run.h5 --gated-volume 0.1")
    make_pop_test(place.folder / "other.run.h5", place.folder / "pop.run.h5")
    yield "catheter", place.run("catheter pop.run.h5 -o catheter.html")
    yield "solve", place.run(f"solve {gel} --mesh 4,2,1 --pressure-kPa 3.1 --probe 22.5,0,0")
    yield "solve", place.run(f"solve {gel} --mesh 4,2,1 --frames")
    yield "solve", place.run("solve examples/imaged-ventricle.study.toml --mesh 4,2,1 --unload --pressure-kPa 1.2")
    yield "mesh", place.run("mesh export examples/imaged-ventricle.study.toml --unload -o unloaded.mesh.toml")
    place.run(f"solve {gel} --mesh 4,2,1 --frames -o theirs.xdmf --cells 2,2,2")
    yield "mesh", place.run("mesh points theirs.xdmf --sigma-mm 0.3 -o theirs.points.csv")
    yield "pv", place.run(f"pv {gel} --mesh 4,2,1 --volume-change-mL 20 --steps 3")
    yield "fit", place.run(f"fit {points} -o points.fit.json")
    yield "fit", place.run(f"fit {gel} --mesh 4,2,1 --pressure-offset 0.1")
    yield "montecarlo", place.run(f"montecarlo {points} --set C1_kPa=8.71 --noise 0.8 --frames 1 --repeats 3")
    yield "design", place.run(f"design {points}")
    yield "design", place.run(f"design {gel} --images --snr 15 --mesh 4,2,1")
    yield "shear", place.run("shear examples/shear-test.csv -o shear.html")
    yield "law", place.run("law examples/bench-tests/uniaxial.csv examples/bench-tests/tube.csv examples/bench-tests/biaxial.csv "
                           "--law neo-hookean --law mooney-rivlin --law examples/laws/mooney-rivlin.law.toml -o law.html")
    yield "law", place.run("law examples/shear-test.csv --law mooney-rivlin", (1,))
    (place.folder / "gels.batch.toml").write_text('format = "diastole-batch"\nversion = 1\noutput = "results"\n[[job]]\ncommand = "fit"\n'
                                                  'inputs = ["examples/phantom-a-points.study.toml", "gel.run.h5"]\narguments = ["--mesh", "4,2,1"]\n')
    yield "batch", place.run("batch gels.batch.toml -o batch.html", (1,))
    yield "batch", place.run("batch gels.batch.toml --slurm gels.sh")
    yield "report", place.run("report gel.run.h5 points.fit.json -o gel.html")
    heart = place.run("lv examples/ventricle.guide.csv -o heart.mesh --fibre-deg 60,-60")
    yield "lv", heart
    make_diffusion(place.folder / "nifti", heart["heart_axes"])
    yield "fibres", place.run("fibres nifti --mesh heart.mesh -o heart.fibres.csv")
    yield "fibres", place.run("fibres nifti --tensors tensors.csv")
    yield "mesh", place.run("mesh export examples/lv-clean.study.toml -o lv.mesh.toml")
    yield "effects", place.run("effects")
    yield "effects", place.run("effects hose-compliance")
    yield "effects", place.run("effects examples/effects/chamber-back-pressure.effect.toml")
    yield "reconstruct", place.run("reconstruct examples/phantom-a.study.toml --mesh 4,2,1 -o gel.points.csv")
    yield "images", place.run("images examples/tagged-gel/dicom")
    yield "track", place.run("track examples/tagged-gel/dicom -o gel.tags.csv")
    yield "scan", place.run(f"scan {gel} --mesh 4,2,1 --set C1_kPa=8.71 -o trial --matrix 48 --phases 3 --peak-kPa 3 --tag-spacing 12")
    heart = "examples/lv-clean.study.toml --mesh 4,2,1 --no-tags --peak-kPa 0.5 --matrix 64 --tag-spacing 12"
    yield "scan", place.run(f"scan {heart} -o flow --flow --diffusion --phases 5")
    make_pressure(place.folder)
    yield "flow", place.run("flow flow/dicom -o heart.flow.csv --pressure pressure.csv --trigger trigger.csv --loop heart.loop.csv")
    place.run(f"scan {heart} -o cine --cine --dark-bath --phases 2 --short-axis=-20,0,10 --long-axis 0,90")
    for images in ("examples/tagged-gel/dicom --edits gel.edits.jsonl", "cine/dicom"):
        desk, said = place.start("diastole", "desk", *images.split(), "--no-browser", "--json", until="}")
        end(desk)
        yield "desk", json.loads(said)
    yield "runs", place.run("runs . kind=run")
    yield "runs", place.run("runs . kind=fit -o runs.html")
    yield "doctor", place.run("doctor --latency-s 0.2", (0, 1))
    rig = (place.folder / "examples/rig.toml").read_text().replace('"/dev/ttyACM0"', '"/dev/null"')
    (place.folder / "null.rig.toml").write_text(rig)
    yield "doctor", place.run("doctor --config null.rig.toml --udev-rules")


def of_sessions(place):
    """Commands that take minutes."""
    study = "tests/data/rig/case-030/case-030.study.toml"
    yield "reference", place.run(f"reference {study} -o rig.reference.json")
    yield "fit", place.run("fit examples/phantom-a-points.study.toml --mesh 4,2,1 --profile --posterior 40")
    yield "explain", place.run(f"explain {study} -o explained", (0, 1))


def of_daemon(place):
    """Commands that speak with the daemon, at a simulated rig."""
    rig, said = place.start("sim_rig", "--link", "pump", "--config", "examples/rig.toml", "--control", "control",
                            "--conductor", "time", until="}")
    port = json.loads(said[said.index("{"):])["modbus_port"]
    daemon, _ = place.start("diastole", "daemon", "--config", "examples/rig.toml", "--port", "pump", "--daq",
                            f"127.0.0.1:{port}", "--socket", "socket", "--journal-dir", "journals", "--conductor", "time",
                            "--console", "0", until="ready")
    at = "--socket socket"
    try:
        yield "status", place.run(f"status {at}")
        yield "selftest", place.run(f"selftest --seconds 2 {at}", (1,))  # no wires there, nothing moved yet
        yield "home", place.run(f"home {at}")
        yield "jog", place.run(f"jog --mL 1 {at}")
        yield "zero", place.run(f"zero --seconds 1 --operator Jo {at}")
        yield "calibrate", place.run(f"calibrate cavity --kPa 0 --seconds 1 --operator Jo {at}")
        yield "settings", place.run(f"settings {at}")
        yield "run", place.run("run examples/gel.experiment.toml --dry-run")
        yield "run", place.run(f"run examples/gel.experiment.toml -o daemon.run.h5 --specimen gel-8 {at}")
        yield "stop", place.run(f"stop {at}", (0, 1))
        yield "continue", place.run(f"continue {at}", (0, 1))
        yield "clear-fault", place.run(f"clear-fault {at}")
        yield "blackbox", place.run(f"blackbox {at}")
        yield "console", place.run(f"console {at}")
    finally:
        for program in (daemon, rig):
            end(program)
    yield "recover", place.run("recover --list journals")
    journal = next((place.folder / "journals").glob("*.journal"))
    yield "recover", place.run(f"recover {journal} -o recovered.run.h5", (0, 1))


def of_board(place):
    """Firmware goes to the emulated board; the image is of the preset `firmware`."""
    yield "flash", place.run("flash --new-key key.pem")
    image = place.firmware / "bin/diastole-stm32f405.image"
    if not image.exists():
        place.skipped.append(f"flash of an image: there is no {image}: build the preset `firmware` first")
        return
    shutil.copy(image, place.folder / "own.image")
    yield "flash", place.run("flash own.image --sign key.pem --counter 3")
    if os.environ.get("DIASTOLE_SANITIZED"):
        place.skipped.append("flash to a board: it lives in real time, of which sanitizers leave too little")
        return
    board, _ = place.start("sim_board", str(image.with_suffix(".bin")), "--link", "board", "--real-time", until="port")
    try:
        yield "flash", place.run(f"flash {image} --port board --dry-run")
        yield "flash", place.run(f"flash {place.firmware / 'tests/newer.image'} --port board")
    finally:
        end(board)


def documents(place, slow=False):
    for group in (of_files, of_daemon, of_board, *((of_sessions,) if slow else ())):
        for command, document in group(place):
            if document is not None:
                yield command, document
