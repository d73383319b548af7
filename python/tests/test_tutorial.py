"""The examples of the tutorial, of the README and of the docstrings run as they stand."""

import doctest
import importlib
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.mark.parametrize("page", ["docs/tutorial.md", "README.md"])
def test_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = doctest.testfile(str(ROOT / page), module_relative=False, optionflags=FLAGS, encoding="utf-8")
    assert found.attempted > 0 and found.failed == 0


@pytest.mark.parametrize("module", ["_functions", "_hazard", "_mission", "_numerics", "_problem", "_solution"])
def test_docstrings(module):
    found = doctest.testmod(importlib.import_module(f"apsides.{module}"), optionflags=FLAGS)
    assert found.failed == 0
