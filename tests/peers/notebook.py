"""Runs a notebook's code cells in their order, as Jupyter does; prints for each, as a line of JSON, what it
has written and the text of its last expression.

notebook.py FILE FOLDER [CODE …]; it runs in FOLDER, and CODE are further cells.
"""

import ast
import contextlib
import io
import json
import os
import sys
from pathlib import Path

path, folder, *more = sys.argv[1:]
cells = json.loads(Path(path).read_text(encoding="utf-8"))["cells"]
sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
os.chdir(folder)
space: dict[str, object] = {"__name__": "__main__"}
for source in (*sources, *more):
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    result = None
    with contextlib.redirect_stdout(io.StringIO()) as written:
        exec(compile(tree, path, "exec"), space)
        if isinstance(last, ast.Expr):
            result = eval(compile(ast.Expression(last.value), path, "eval"), space)
    told = {"written": written.getvalue(), "result": None if result is None else repr(result)}
    print(json.dumps(told), flush=True)
