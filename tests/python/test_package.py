#!/usr/bin/python3
"""The Python package against the programs: test_package.py SOURCE_FOLDER BIN_FOLDER."""

import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

source, programs = pathlib.Path(sys.argv.pop(1)).resolve(), pathlib.Path(sys.argv.pop(1)).resolve()
os.environ["DIASTOLE"] = str(programs / "diastole")
sys.path[:0] = [str(source / "python"), str(source / "tests/flow")]

import diastole  # noqa: E402
import diastole.classes  # noqa: E402
import diastole.rig  # noqa: E402
import h5py  # noqa: E402
import hostile_run_files  # noqa: E402

from diastole.record import Record  # noqa: E402

EXPERIMENT = """format = "diastole-experiment"
version = 1
[[segment]]
waveform = "parabolic"
stroke_mL = 20
period_s = 0.6
cycles = 4
"""


def least_document(schema):
    """The smallest that a schema allows."""
    if "anyOf" in schema:
        return least_document(schema["anyOf"][0])
    if "enum" in schema:
        return schema["enum"][0]
    kinds = schema.get("type", "null")
    kind = kinds[0] if isinstance(kinds, list) else kinds
    if kind == "object":
        return {key: least_document(schema["properties"][key]) for key in schema.get("required", ())}
    return {"array": [], "boolean": False, "integer": 0, "number": 0.0, "string": "", "null": None}[kind]


class InAFolder(unittest.TestCase):
    def setUp(self):
        self.work = tempfile.TemporaryDirectory()
        self.addCleanup(self.work.cleanup)
        self.folder = pathlib.Path(self.work.name)
        os.environ["XDG_CACHE_HOME"] = f"{self.work.name}/cache"
        (self.folder / "e.toml").write_text(EXPERIMENT)


class Runs(InAFolder):
    def test_a_run_is_simulated_read_noted_and_found(self):
        run = diastole.simulate(self.folder / "e.toml", self.folder / "a.run.h5", specimen="gel 7", operator="Jo",
                                room_temperature_C=21.5, note=["first"])
        self.assertEqual((run.session["specimen"], run.session["room_temperature_C"]), ("gel 7", 21.5))
        self.assertEqual([(note.author, note.text) for note in run.notes], [("Jo", "first")])
        self.assertEqual(len(run.trigger_s), 4)
        self.assertEqual(len(run.time_s), len(run.cavity_kPa))
        self.assertAlmostEqual(run.volume_mL().max(), 20, delta=0.1)
        run.note("the second", author="Ann")
        self.assertEqual([note.author for note in run.notes], ["Jo", "Ann"])
        self.assertTrue(run.inspect().sound)
        self.assertEqual(run.inspect().session.notes[1].text, "the second")
        self.assertEqual(len(run.frames(4).frames), 4)
        self.assertGreaterEqual(run.frames(4).frames[0].cycles, 3)
        found = diastole.runs(self.folder, "specimen=gel 7")
        self.assertEqual([(each.path, each.cycles, each.sound) for each in found], [("a.run.h5", 4, True)])
        self.assertIn("<svg", run._repr_html_())
        same = diastole.compare(run, self.folder / "a.run.h5")
        self.assertFalse(same.beyond_noise)
        self.assertIn("<svg", same._repr_html_())

    def test_what_is_no_run_is_refused(self):
        with self.assertRaisesRegex(OSError, r"e\.toml: "):
            diastole.Run(self.folder / "e.toml")
        with self.assertRaisesRegex(FileNotFoundError, r"missing\.run\.h5: "):
            diastole.Run(self.folder / "missing.run.h5")
        with self.assertRaises(diastole.DiastoleError) as refused:
            diastole.simulate(self.folder / "missing.toml", self.folder / "a.run.h5")
        self.assertEqual(refused.exception.code, 2)
        self.assertIn("missing.toml", str(refused.exception))


    def test_a_dataset_that_is_not_there_is_named_with_those_that_are(self):
        run = diastole.simulate(self.folder / "e.toml", self.folder / "a.run.h5")
        for absent in ("nope", "pressure/pump_kPa", "pressure"):
            with self.assertRaisesRegex(KeyError, rf"a\.run\.h5: has no dataset {absent}, but .*pressure/cavity_kPa"):
                run.column(absent)
        self.assertEqual(len(run.column("/trigger/time_s")), 4)


class HostileFiles(InAFolder):
    """Those that the program refuses, read in as little memory as numpy leaves."""

    READ_ALL = "import sys, diastole; run = diastole.Run(sys.argv[1]); run.time_s, run.cavity_kPa, run.trigger_s, run.volume_mL()"

    def read(self, file):
        bounded = {**os.environ, "PYTHONPATH": str(source / "python"), "OPENBLAS_NUM_THREADS": "1"}
        return subprocess.run([sys.executable, "-B", "-c", self.READ_ALL, file], env=bounded, capture_output=True, text=True, timeout=60,
                              preexec_fn=hostile_run_files.limited)

    def test_are_refused_with_their_place_before_memory_is_taken(self):
        sound = diastole.simulate(self.folder / "e.toml", self.folder / "sound.run.h5").path
        self.assertEqual(self.read(sound).stderr, "")
        unread = (hostile_run_files.one_text_many_times,)  # a table that the package does not read
        for tampered in (each for each in hostile_run_files.HOSTILE if each not in unread):
            with self.subTest(tampered.__name__):
                file = self.folder / "hostile.run.h5"
                shutil.copy(sound, file)
                with h5py.File(file, "r+") as run:
                    expected = tampered(run, self.folder)
                self.assertTrue(hostile_run_files.after(file, tampered))
                refused = self.read(file).stderr.splitlines()
                said = [line for line in refused if line.startswith("ValueError: ")]
                self.assertTrue(said and expected in said[0] and str(file) in said[0], refused[-3:])

    def test_what_a_run_file_has_to_hold_is_asked_for(self):
        sound = diastole.simulate(self.folder / "e.toml", self.folder / "sound.run.h5").path
        file = self.folder / "other.run.h5"

        def refusal(change):
            shutil.copy(sound, file)
            with h5py.File(file, "r+") as run:
                change(run)
            with self.assertRaises(ValueError) as refused:
                diastole.Run(file)
            return str(refused.exception)

        self.assertIn("another version", refusal(lambda run: run.attrs.modify("format_version", 99)))
        self.assertIn("attribute run_id: is missing", refusal(lambda run: run.attrs.pop("run_id")))
        self.assertIn("group /rig: is missing", refusal(lambda run: run.pop("rig")))
        shutil.copy(sound, file)
        with h5py.File(file, "r+") as run:
            run.require_group("session").attrs["operator"] = h5py.Empty("f")
        self.assertNotIn("operator", diastole.Run(file).session)

    def test_what_only_a_plug_in_unpacks_is_refused_unread(self):
        file = diastole.simulate(self.folder / "e.toml", self.folder / "a.run.h5").path
        with h5py.File(file, "r+") as run:
            del run["pump/commanded_mL"]
            created = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            created.set_chunk((10,))
            created.set_filter(32001, h5py.h5z.FLAG_OPTIONAL)  # blosc's number
            h5py.h5d.create(run["pump"].id, b"commanded_mL", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((10,)), created)
        with self.assertRaisesRegex(ValueError, "dataset /pump/commanded_mL: is packed in a way that only a plug-in knows"):
            diastole.Run(file)


class Studies(InAFolder):
    def test_a_solution_and_a_fit(self):
        study = diastole.Study(source / "examples/phantom-a-points.study.toml")
        solution = study.solve(pressure_kPa=3.1, mesh="4,2,1", set={"C1_kPa": 8.8}, probe=[(22.5, 0, 0)])
        self.assertGreater(solution.cavity_volume_change_mL, 15)
        self.assertGreater(solution.probes[0].displacement_mm[0], 1)
        fit = study.fit(mesh="4,2,1")
        self.assertTrue(fit.converged)
        self.assertTrue(fit.parameters["C1_kPa"].ci95[0] < fit.parameters["C1_kPa"].value < fit.parameters["C1_kPa"].ci95[1])
        self.assertIn("C1_kPa", fit._repr_html_())
        self.assertIn("neo-hookean", study._repr_html_())

    def test_tags_are_followed_in_the_images_of_the_study(self):
        tracking = diastole.Study(source / "examples/tagged-gel/tagged-gel.study.toml").track(self.folder / "gel.tags.csv")
        self.assertGreater(tracking.points, 1000)
        self.assertTrue((self.folder / "gel.tags.csv").is_file())
        with self.assertRaisesRegex(ValueError, "names no folder"):
            diastole.Study(source / "examples/phantom-a-points.study.toml").track(self.folder / "none.tags.csv")

    def test_an_explanation_is_read_from_what_the_program_prints(self):
        answer = least_document(json.loads((source / "docs/schema/explain.schema.json").read_text()))
        answer.update(verdict="explained", summary="a bubble & more")
        stored = self.folder / "diastole"
        stored.write_text(f"#!/bin/sh\necho \"$@\" > {self.folder}/said\ncat <<'END'\n{json.dumps(answer)}\nEND\nexit 1\n")
        stored.chmod(0o755)
        with unittest.mock.patch.dict(os.environ, DIASTOLE=str(stored)):
            found = diastole.Study(source / "examples/phantom-a-points.study.toml").explain(self.folder / "out", seed=7)
        self.assertEqual((self.folder / "said").read_text().split()[2:], ["-o", str(self.folder / "out"), "--seed", "7", "--json"])
        self.assertEqual((found.verdict, found.effects), ("explained", []))
        self.assertIn("a bubble &amp; more", found._repr_html_())

    def test_documents_of_another_form_are_refused_with_their_place(self):
        with self.assertRaisesRegex(TypeError, r"Fit\.parameters\.C1_kPa\.value"):
            plain = {"str": "", "int": 1, "float": 1.0, "bool": True}
            members = {member.name: plain.get(member.kind) for member in diastole.classes.shapes()["Fit"].members}
            diastole.results.Fit.from_json({**members, "parameters": {"C1_kPa": {"value": "8.8"}}})
        with self.assertRaisesRegex(TypeError, "lacks"):
            diastole.results.Fit.from_json({})
        self.assertTrue(issubclass(diastole.results.Fit, Record))


class AtARig(InAFolder):
    """A simulated rig with a daemon of conducted time."""

    def setUp(self):
        super().setUp()
        os.symlink(source / "examples", self.folder / "examples")
        self.programs = []
        said = self.start("}", "sim_rig", "--link", "pump", "--config", "examples/rig.toml", "--conductor", "time")
        port = json.loads(said[said.index("{"):])["modbus_port"]
        self.start("ready", "diastole", "daemon", "--config", "examples/rig.toml", "--port", "pump", "--daq", f"127.0.0.1:{port}",
                   "--socket", "socket", "--journal-dir", "journals", "--conductor", "time")

    def start(self, until, name, *words):
        program = subprocess.Popen([programs / name, *words], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.programs.insert(0, program)
        said = ""
        while until not in said:
            line = program.stdout.readline()
            self.assertTrue(line, f"{name} ended: {said}")
            said += line
        return said

    def tearDown(self):
        for program in self.programs:
            program.send_signal(signal.SIGTERM)
            program.communicate()

    def test_a_session_with_live_samples(self):
        with diastole.Rig(self.folder / "socket") as rig:
            self.assertEqual(rig.status()["state"], "unhomed")
            self.assertEqual(rig.home()["state"], "homed")
            rig.start(self.folder / "e.toml", specimen="gel-8", notes=["live"])
            samples = list(rig.live(interval_s=0.01))
            run_file = rig.progress()["result"]["run_file"]
            run = diastole.Run(run_file)
            self.assertGreater(len(samples), 300)
            self.assertTrue(all(a.time_s < b.time_s for a, b in zip(samples, samples[1:])))
            largest = max(sample.kPa for sample in samples if math.isfinite(sample.kPa))
            self.assertAlmostEqual(largest, float(max(run.cavity_kPa)), delta=0.2)
            self.assertEqual((run.session["specimen"], run.notes[0].text), ("gel-8", "live"))
            again = rig.run(self.folder / "e.toml", self.folder / "again.run.h5", operator="Jo")
            self.assertEqual((again.session["operator"], len(again.trigger_s)), ("Jo", 4))
            with self.assertRaises(FileExistsError):
                rig.run(self.folder / "e.toml", self.folder / "again.run.h5")
            with self.assertRaises(diastole.DiastoleError):
                rig.call("run.start", experiment="nonsense", file="x")

    def test_a_run_is_stopped(self):
        (self.folder / "long.toml").write_text(EXPERIMENT.replace("cycles = 4", "cycles = 5000"))
        with diastole.Rig(self.folder / "socket") as rig:
            rig.home()
            self.assertFalse(rig.stop())
            rig.start(self.folder / "long.toml")
            while not rig.progress()["triggers"]:
                time.sleep(0.01)
            self.assertTrue(rig.stop(at_cycle_end=True))
            for _ in rig.live(interval_s=0.01):
                pass
            run = diastole.Run(rig.progress()["result"]["run_file"])
        self.assertLess(len(run.trigger_s), 5000)

    def test_nobody_listens(self):
        with self.assertRaises(diastole.DiastoleError) as refused:
            diastole.Rig(self.folder / "no-socket")
        self.assertEqual(refused.exception.code, 3)


class Daemons(InAFolder):
    def test_one_of_another_user_is_not_taken_where_others_can_put_a_socket(self):
        stranger = os.geteuid() + 1
        place = pathlib.Path(tempfile.mkdtemp())  # below /tmp, where everybody may write
        try:
            self.assertFalse(diastole.rig._may_serve(stranger, f"{place}/daemon.sock"))
            self.assertTrue(diastole.rig._may_serve(os.geteuid(), f"{place}/daemon.sock"))
            self.assertTrue(diastole.rig._may_serve(0, f"{place}/daemon.sock"))
        finally:
            place.rmdir()
        with unittest.mock.patch.dict(os.environ):
            os.environ.pop("XDG_RUNTIME_DIR", None)
            self.assertFalse(diastole.rig.default_socket().startswith("/tmp/"))


class Overhead(InAFolder):
    def test_a_call_costs_little_beyond_the_program(self):
        """50 ms at most, the least of some, so that other work does not count."""
        run = diastole.simulate(self.folder / "e.toml", self.folder / "a.run.h5")
        line = [os.environ["DIASTOLE"], "inspect", str(run.path), "--json"]

        def least_s(work):
            took = []
            for _ in range(7):
                began = time.perf_counter()
                work()
                took.append(time.perf_counter() - began)
            return min(took)

        beyond_s = least_s(run.inspect) - least_s(lambda: subprocess.run(line, capture_output=True, check=True))
        print(f"{1e3 * beyond_s:.1f} ms beyond the program's own time")
        self.assertLess(beyond_s, 0.050)


if __name__ == "__main__":
    unittest.main()
