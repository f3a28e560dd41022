#!/usr/bin/python3
"""Holds every command's --json document to its schema in docs/schema, and python/diastole/results.pyi to the schemas.

    test_schemas.py SOURCE_FOLDER BIN_FOLDER [--slow]
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import jsonschema

import documents

NO_DOCUMENT = {"daemon"}
SKIPPED = 77  # of CMake's SKIP_RETURN_CODE


def errors_of(validator, document):
    for error in validator.iter_errors(document):
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error.absolute_path)
        yield f"{place or 'the document'}: {error.message[:300]}"


def main(source, programs, slow):
    folder = source / "docs/schema"
    validators, problems, seen = {}, [], set()
    for file in sorted(folder.glob("*.schema.json")):
        schema = json.loads(file.read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        if not schema.get("description"):
            problems.append(f"{file.name} does not say what the document is")
        validators[file.name.removesuffix(".schema.json")] = jsonschema.Draft202012Validator(schema)

    said = subprocess.run([programs / "diastole", "--help"], capture_output=True, text=True, check=True).stdout
    commands = set(re.findall(r"^  ([a-z-]+) {2,}", said[said.index("Subcommands:"):], re.MULTILINE))
    problems += [f"{name} has no schema in docs/schema" for name in sorted(commands - set(validators) - NO_DOCUMENT)]
    problems += [f"docs/schema has a schema of {name}, which is no command" for name in sorted(set(validators) - commands)]

    with tempfile.TemporaryDirectory() as work:
        place = documents.Place(work, programs, source)
        for command, document in documents.documents(place, slow):
            seen.add(command)
            found = list(errors_of(validators[command], document))
            print(f"{command}: {'as its schema says' if not found else found[0]}", flush=True)
            problems += [f"{command}: {problem}" for problem in found]
    unheld = commands - seen - NO_DOCUMENT - (set() if slow else documents.SLOW)
    problems += [f"{name} was not asked for its document" for name in sorted(unheld)]

    sys.path.insert(0, str(source / "python"))
    from diastole.classes import stub

    if (source / "python/diastole/results.pyi").read_text() != stub():
        problems.append("python/diastole/results.pyi is not what the schemas make: tools/json_schema python")
    print("\n".join(problems + [f"skipped: {what}" for what in place.skipped]), file=sys.stderr)
    return 1 if problems else SKIPPED if place.skipped else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), "--slow" in sys.argv))
