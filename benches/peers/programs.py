"""The programs of this package that the comparisons run. No third-party imports, so that every script may use it."""

import json
import os
import subprocess

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def built(program):
    """Path of a program of this package, built if need be."""
    subprocess.run(
        ["cargo", "build", "--release", "-p", "apsides-benches", "--bin", program], cwd=ROOT, check=True
    )
    target = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
    return os.path.join(target, "release", program)


def text(*command):
    """What a program prints."""
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def output(*command):
    """The JSON that a program prints."""
    return json.loads(text(*command))
