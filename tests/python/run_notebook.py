#!/usr/bin/python3
"""Runs a notebook's cells in their order, as Jupyter would, in an empty folder that sees examples/: run_notebook.py SOURCE BIN NOTEBOOK."""

import ast
import json
import os
import pathlib
import sys
import tempfile


def main(source, programs, notebook):
    cells = json.loads((source / notebook).read_text())["cells"]
    os.environ["DIASTOLE"] = str(programs / "diastole")
    sys.path.insert(0, str(source / "python"))
    with tempfile.TemporaryDirectory() as work:
        os.environ["XDG_CACHE_HOME"] = f"{work}/cache"
        os.chdir(work)
        os.symlink(source / "examples", "examples")
        names, shown = {}, 0
        for number, cell in enumerate(cells):
            if cell["cell_type"] != "code":
                continue
            assert not cell["outputs"], f"cell {number} holds outputs: they do not belong into the tree"
            tree = ast.parse("".join(cell["source"]))
            last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, f"{notebook}, cell {number}", "exec"), names)
            if last is None:
                continue
            value = eval(compile(ast.Expression(last.value), f"{notebook}, cell {number}", "eval"), names)
            html = value._repr_html_() if hasattr(value, "_repr_html_") else ""
            shown += bool(html)
            print(f"cell {number}: {len(html)} characters of HTML" if html else f"cell {number}: {value!r}"[:200], flush=True)
        assert shown, "no cell shows anything"


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3])
