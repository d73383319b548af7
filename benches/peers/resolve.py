"""Solving a landing again after changes of its values: figures of the program `resolve` of this package, without a peer. See README.md."""

import os
import subprocess
import sys

import findings

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--samples", type=int, default=1000, help="sets of values")
    arguments = parser.parse_args()
    command = ["cargo", "run", "--quiet", "--release", "-p", "apsides-benches", "--bin", "resolve", "--", "--samples", str(arguments.samples)]
    figures = findings.Figures(
        "Solving a landing again after changes of its values",
        "The landing from perilune on 100 intervals of 3 points, and on the meshes of the method, apsides alone: milliseconds of processor time. Values"
        " of mass, thrust, specific impulse and altitude change.",
        ["mesh and work", "time", "iterations", "remarks"],
    )
    for mesh, options in (("100 x 3", ["--intervals", "100"]), ("own meshes", [])):
        run = subprocess.run([*command, *options], cwd=ROOT, capture_output=True, text=True)
        if run.returncode:
            sys.exit(f"resolve failed: {run.stderr}")
        print(run.stdout, flush=True)
        for work, *cells in findings.of_table(run.stdout[run.stdout.index("| work |") :]):
            figures.add(f"{mesh}: {work}", *cells)
    findings.write(arguments.findings, figures)


if __name__ == "__main__":
    main()
