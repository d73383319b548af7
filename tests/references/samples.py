"""Samples of a Monte Carlo run as Parquet, read by a program that is not ours: python samples.py DIRECTORY

DIRECTORY is one that `apsides montecarlo --format parquet --out` wrote. Every cell of montecarlo.parquet, read by pyarrow, is that of montecarlo.csv,
to the bit; samples without a result are NaN in both. Exit status 1 where anything differs.
"""

import csv
import struct
import sys
from pathlib import Path

import pyarrow.parquet

# The last column of the text tells whether a row is as it was written.
DIGEST = "digest"


def bits(value):
    number = float(value)
    return "nan" if number != number else struct.pack("<d", number)


def main():
    directory = Path(sys.argv[1])
    table = pyarrow.parquet.read_table(directory / "montecarlo.parquet")
    with open(directory / "montecarlo.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    heads, rows = rows[0], rows[1:]
    if heads != [*table.column_names, DIGEST]:
        sys.exit(f"columns {table.column_names}, expected {heads[:-1]}")
    if table.num_rows != len(rows):
        sys.exit(f"{table.num_rows} rows, expected {len(rows)}")
    for k, name in enumerate(table.column_names):
        for index, (found, row) in enumerate(zip(table.column(name).to_pylist(), rows)):
            if bits(found) != bits(row[k]):
                sys.exit(f"{name} of row {index}: {found}, expected {row[k]}")
    groups = pyarrow.parquet.ParquetFile(directory / "montecarlo.parquet").num_row_groups
    print(f"montecarlo.parquet: {table.num_rows} rows in {groups} groups, {len(table.column_names)} columns as in montecarlo.csv")


if __name__ == "__main__":
    main()
