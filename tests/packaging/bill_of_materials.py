"""The bill of materials names every library that the programs ask for, with its package's version and its own digest, and is
equal when it is made again.

bill_of_materials.py BUILD_DIR SOURCE_DIR PROGRAM...
"""

import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

build, source, *programs = sys.argv[1:]
written = pathlib.Path(build) / "diastole.cdx.json"
bill = json.loads(written.read_text())
assert bill["bomFormat"] == "CycloneDX" and bill["specVersion"] == "1.5" and bill["version"] == 1

components = bill["components"]
references = [component["bom-ref"] for component in components]
assert len(set(references)) == len(references), "a reference stands twice"
assert bill["dependencies"] == [{"ref": "diastole", "dependsOn": references}]
files = {}
for component in components:
    assert component["name"] and component["type"] in ("library", "file")
    if component["type"] == "library" and not component["bom-ref"].startswith("third_party/"):
        assert component["version"] and component["purl"].startswith("pkg:deb/debian/"), component
    for fact in component.get("properties", []):
        if fact["name"] == "diastole:file":
            path, digest = re.fullmatch(r"(\S+) sha256:([0-9a-f]{64})", fact["value"]).groups()
            files[os.path.basename(path)] = path
            assert hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest() == digest, path
names = {component["name"] for component in components}

asked, strangers = set(), {component["bom-ref"] for component in components if component["type"] == "file"}
for program in programs:
    said = subprocess.run(["readelf", "-dW", program], check=True, capture_output=True, text=True).stdout
    needed = set(re.findall(r"\(NEEDED\).*\[(.+)\]", said))
    taken = dict(re.findall(r"(\S+) => (/\S+)", subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout))
    for library in sorted(needed):
        path = os.path.realpath(taken[library])
        assert files.get(os.path.basename(path)) == path or path in strangers, f"{library} stands in no component"
    asked |= needed
assert len(asked) > 10, "readelf found no libraries"
for folder in (path.name for path in (pathlib.Path(source) / "third_party").iterdir() if path.is_dir()):
    assert folder in names, f"third_party/{folder} stands in no component"
assert "libgtest-dev" not in names, "what only tests use is no part of the programs"
assert "libeigen3-dev" in names, "headers that are compiled in belong to it"

with tempfile.TemporaryDirectory() as place:
    again = pathlib.Path(place) / "again.cdx.json"
    subprocess.run(["/usr/bin/python3", "-B", f"{source}/packaging/bill_of_materials", "--version",
                    bill["metadata"]["component"]["version"], "--build", build, "--vendored", f"{source}/third_party",
                    "-o", str(again), *programs], check=True)
    assert again.read_bytes() == written.read_bytes(), "made again it differs"
print(f"{len(components)} components, {len(asked)} libraries asked for by the programs")
