"""All comparisons one after the other: `summary.json`, and the page docs/benchmarks.md.

Run by `cargo xtask bench --peers` in an environment with requirements.txt. What has been measured stays in the summary when a later script
fails or is stopped; the page is written once all are there.
"""

import argparse
import datetime
import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import tempfile

from findings.page import page

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
# In the order of the page.
SCRIPTS = {
    "gallery": ["--turns", "5"],
    "landing": ["--turns", "3"],
    "hock_schittkowski": [],
    "flatness": ["--turns", "3"],
    "geo": [],
    "convex": ["--runs", "5"],
    "latency": ["--starts", "150", "--runs", "2"],
    "propagation": [],
    "moving_mass": [],
    "hazard": [],
    "resolve": [],
}


def machine():
    """The processor, by the name that the system has for it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def versions():
    with open(os.path.join(HERE, "requirements.txt"), encoding="utf-8") as file:
        names = [line.split("==")[0] for line in file if "==" in line]
    found = []
    for name in names:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            pass
    return f"Python {platform.python_version()}, " + ", ".join(found + [f"fatrop {version} (with casadi)" for version in fatrop()])


def fatrop():
    """The version of the library that CasADi brings along, by the name of its file; none without CasADi."""
    try:
        names = [file.name for file in importlib.metadata.files("casadi") or ()]
    except importlib.metadata.PackageNotFoundError:
        return []
    return sorted({match[1] for match in map(re.compile(r"libfatrop\.so\.(\d+\.\d+\.\d+)").fullmatch, names) if match})


def measured(script, folder):
    """The findings of one script; None if it failed or found nothing."""
    path = os.path.join(folder, f"{script}.json")
    command = [sys.executable, os.path.join(HERE, f"{script}.py"), *SCRIPTS[script], "--findings", path]
    print(f"== {script}", flush=True)
    status = subprocess.run(command, cwd=ROOT).returncode
    if status != 0 or not os.path.exists(path):
        return None
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def kept(path):
    """The summary that is there, or an empty one."""
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    return {"scripts": {}}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(SCRIPTS), help="these alone; the others stay as the summary has them")
    parser.add_argument("--summary", default=os.path.join(ROOT, "target", "summary.json"))
    parser.add_argument("--page", default=os.path.join(ROOT, "docs", "benchmarks.md"))
    arguments = parser.parse_args()
    summary = kept(arguments.summary) if arguments.only else {"scripts": {}}
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        for script in arguments.only or SCRIPTS:
            found = measured(script, folder)
            if found is None:
                failed.append(script)
                continue
            summary["scripts"][script] = found
            summary |= {"date": datetime.date.today().isoformat(), "machine": machine(), "versions": versions()}
            summary["topics"] = [topic for name in SCRIPTS for topic in summary["scripts"].get(name, [])]
            with open(arguments.summary, "w", encoding="utf-8") as file:
                json.dump(summary, file, indent=1)
    missing = [script for script in SCRIPTS if script not in summary["scripts"]]
    if failed or missing:
        sys.exit(f"no page: without findings of {', '.join(failed or missing)}; the others are in {arguments.summary}")
    with open(arguments.page, "w", encoding="utf-8") as file:
        file.write(page(summary))
    print(f"{arguments.page} and {arguments.summary} written")


if __name__ == "__main__":
    main()
