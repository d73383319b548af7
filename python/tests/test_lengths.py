"""A problem takes less than 25 lines of Python, and less than 40 lines of a file."""

import ast
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

MOST_LINES_OF_PYTHON = 24
MOST_LINES_OF_A_FILE = 39


def test_statements_in_python():
    page = (ROOT / "python" / "docs" / "tutorial.md").read_text(encoding="utf-8")
    examples = [block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if ".solve()" in block]
    assert len(examples) >= 5
    for example in examples:
        assert sum(line.startswith((">>>", "...")) for line in example.splitlines()) <= MOST_LINES_OF_PYTHON, example
    bench = ast.parse((ROOT / "python" / "benches" / "gallery.py").read_text(encoding="utf-8"))
    statements = [f for f in bench.body if isinstance(f, ast.FunctionDef) and not f.args.args and f.name != "main"]
    assert len(statements) >= 6
    for f in statements:
        assert f.end_lineno - f.lineno + 1 <= MOST_LINES_OF_PYTHON, f.name


def test_statements_in_files():
    page = (ROOT / "docs" / "problems.md").read_text(encoding="utf-8")
    example = re.search(r"```toml\n(.*?)```", page, re.DOTALL)[1]
    assert len(example.splitlines()) <= MOST_LINES_OF_A_FILE
