"""Solving a landing again after changes of its values: figures of the program `resolve` of this package, without a peer. See README.md."""

import findings
from programs import built, text


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--samples", type=int, default=1000, help="sets of values")
    parser.add_argument("--program", default=None, help="the built program `resolve`")
    arguments = parser.parse_args()
    command = [arguments.program or built("resolve"), "--samples", arguments.samples]
    figures = findings.Figures(
        "Solving a landing again after changes of its values",
        "The landing from perilune on 100 intervals of 3 points, and on the meshes of the method, apsides alone: milliseconds of processor time. Values"
        " of mass, thrust, specific impulse and altitude change.",
        ["mesh and work", "time", "iterations", "remarks"],
    )
    for mesh, options in (("100 x 3", ["--intervals", "100"]), ("own meshes", [])):
        printed = text(*command, *options)
        print(printed, flush=True)
        for work, *cells in findings.of_table(printed[printed.index("| work |") :]):
            figures.add(f"{mesh}: {work}", *cells)
    findings.write(arguments.findings, figures)


if __name__ == "__main__":
    main()
