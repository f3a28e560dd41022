#!/usr/bin/env python3
"""Fails when a name in the product is made of a word for which the field has a better one: NAMES.py SOURCE_FOLDER."""
import pathlib
import re
import sys

INSTEAD = {  # any part of a name, as tell in tell_uncertainty
    "tell tells telling teller told untold": "report, return, estimate",
    "taken": "received, consumed, volume_change",
    "lump lumps": "inclusion",
    "ingredient ingredients": "term",
    "nudge nudges": "perturbation",
    "glide": "move",
    "guest guests visitor visitors": "connection",
    "hall door doors": "server, endpoint, access",
    "story": "journal",
    "patience": "timeout",
    "seldom": "probability, tail",
}
BETTER = {word: better for words, better in INSTEAD.items() for word in words.split()}
WHOLE = {"Look": "observation", "Visitor": None}  # whole names; None: the pattern's own name is allowed
NO_CODE = re.compile(r"""R"(\w*)\(.*?\)\1"|//[^\n]*|/\*.*?\*/|'(?:\\.|[^'\\\n])'|"(?:\\.|[^"\\\n])*"|`(?:\\.|[^`\\])*`""", re.DOTALL)


def findings(text):
    code = NO_CODE.sub(lambda comment_or_text: " " + "\n" * comment_or_text[0].count("\n"), text)
    for number, line in enumerate(code.split("\n"), 1):
        for name in re.findall(r"[A-Za-z_]\w*", line):
            parts = [part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)]
            better = WHOLE[name] if name in WHOLE else next((BETTER[part] for part in parts if part in BETTER), None)
            if better:
                yield f"{number}: {name}: say {better}"


assert len(list(findings("int tell_uncertainty(double taken_mL);\nclass Look; // told\n"))) == 3
files = [file for folder in ("protocol", "firmware", "host", "estimator", "tools") for file in pathlib.Path(sys.argv[1], folder).rglob("*")]
files = [file for file in files if file.suffix in (".cpp", ".hpp", ".inc", ".js")]
found = [f"{file}:{finding}" for file in files for finding in findings(file.read_text("utf8"))]
sys.exit("\n".join(found) or (0 if files else "no sources"))
