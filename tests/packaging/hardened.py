"""The programs as they are shipped have what cmake/Hardening.cmake asks for: looked up in their ELF files, and the options in
the compiler's commands.

hardened.py BUILD_DIR PROGRAM...
"""

import json
import pathlib
import platform
import re
import subprocess
import sys

build, *programs = sys.argv[1:]
wrong = []


def said(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def expect(holds, what):
    if not holds:
        wrong.append(what)


for program in programs:
    name = pathlib.Path(program).name
    headers, dynamic = said("readelf", "-hlW", program), said("readelf", "-dW", program)
    symbols = said("readelf", "--dyn-syms", "-W", program)
    expect(re.search(r"Type:\s+DYN", headers) and "PIE" in dynamic, f"{name} is not position-independent")
    expect("GNU_RELRO" in headers, f"{name}: no part of its data is made read-only (RELRO)")
    expect(re.search(r"BIND_NOW|FLAGS_1.*\bNOW\b", dynamic), f"{name}: its table of functions stays writable (BIND_NOW)")
    expect(re.search(r"GNU_STACK\s+\S+\s+\S+\s+\S+\s+\S+\s+\S+\s+RW\s", headers), f"{name}: its stack can be executed")
    expect(not re.search(r"LOAD\s.*\bRWE\b", headers), f"{name}: memory that can be both written and executed")
    expect("TEXTREL" not in dynamic, f"{name}: its code is written to when it is loaded")
    expect(not re.search(r"\((RPATH|RUNPATH)\)", dynamic), f"{name}: looks for libraries where its build was")
    expect("__stack_chk_fail" in symbols, f"{name}: no stack is guarded")
    checked = set(re.findall(r"\b__(\w+)_chk\b", symbols)) - {"stack"}
    # clang uses fewer of them than GCC (docs/decisions/0044-one-build-for-sanitizers-and-fuzzing.md): four in `diastole`, memcpy alone
    # in the simulated rig, which formats with fmt.
    needed = {"memcpy", "vsnprintf"} if name == "diastole" else {"memcpy"}
    expect(needed <= checked, f"{name}: the C library's checked functions are not used ({', '.join(sorted(checked))})")
    expect("__glibcxx_assert_fail" in symbols, f"{name}: indices into containers are not checked (_GLIBCXX_ASSERTIONS)")
    if platform.machine() == "x86_64":
        # The property of the whole program also needs the C library's start files, which Debian 12 builds without.
        landings = pathlib.Path(program).read_bytes().count(b"\xf3\x0f\x1e\xfa")
        expect(landings > 1000, f"{name}: {landings} functions begin with endbr64 (CET)")

options = ["-D_FORTIFY_SOURCE=3", "-fstack-protector-strong", "-fPIE"]
if platform.machine() == "x86_64":
    options += ["-fcf-protection", "-fstack-clash-protection"]
commands = json.loads((pathlib.Path(build) / "compile_commands.json").read_text())
expect(len(commands) > 100, "the compiler's commands are not all there")
for option in options:
    without = [entry["file"] for entry in commands if option not in entry["command"].split()]
    expect(not without, f"compiled without {option}: {', '.join(without[:3])}{' ...' if len(without) > 3 else ''}")
print(f"{len(programs)} programs, {len(commands)} compilations")
sys.exit("\n".join(wrong) if wrong else 0)
