"""What a comparison found, as rows that programs read, too: `--findings FILE` of each script.

No third-party imports, so that every script may use it.
"""

import argparse
import json
import math


class Findings:
    """Rows of one comparison: a work done by apsides and by a peer."""

    def __init__(self, topic, note):
        self.topic, self.note, self.rows = topic, note, []

    def add(self, work, peer, ours, theirs, accuracy="", unit="ms"):
        """A work that took `ours` by apsides and `theirs` by the peer, with the accuracy that both reached. Left out where one did not
        get there: such a work has no ratio."""
        if ours and theirs and math.isfinite(ours) and math.isfinite(theirs):
            row = {"work": work, "peer": peer, "apsides": ours, "other": theirs, "unit": unit, "accuracy": accuracy}
            self.rows.append(row)


class Figures:
    """Figures of apsides alone, as a table of words: nothing to compare with."""

    def __init__(self, topic, note, heading):
        self.topic, self.note, self.heading, self.lines = topic, note, heading, []

    def add(self, *cells):
        self.lines.append([str(cell) for cell in cells])


def of_table(text):
    """The cells of the lines of a Markdown table, without heading and rule."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines[2:]]


def parser(description):
    """The parser of a comparison."""
    made = argparse.ArgumentParser(description=description.splitlines()[0])
    made.add_argument("--findings", default=None, help="file for the rows, JSON")
    return made


def write(path, *findings):
    """Writes the findings to a file if there is one."""
    if path:
        with open(path, "w", encoding="utf-8") as file:
            json.dump([vars(found) for found in findings], file, indent=1)
