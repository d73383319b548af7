"""The page of all comparisons: docs/benchmarks.md."""

import statistics

HEAD = """# Benchmarks beside other programs

Made by `cargo xtask bench --peers`, which installs the peers into a fresh environment, runs the scripts of
[benches/peers](../benches/peers/README.md) one after the other and writes this page and `summary.json` in the target folder. Each row is one work, done by
both to the accuracy in its last column; times are the least of several turns, of one thread where nothing else is said. A ratio is the peer's time over that
of apsides: below 1 the peer is ahead. What is equal on both sides, and what is not, is in the README of that folder.
"""


def ratio(row):
    return row["other"] / row["apsides"]


def time(value):
    """Three digits."""
    digits = f"{value:.3g}"
    return f"{value:.0f}" if "e" in digits else digits


def overview(topics):
    lines = ["| comparison | works | median ratio | least | peer ahead in |", "| --- | ---: | ---: | ---: | ---: |"]
    for topic in topics:
        ratios = [ratio(row) for row in topic["rows"]]
        behind = sum(r < 1.0 for r in ratios)
        lines.append(
            f"| [{topic['topic']}](#{anchor(topic['topic'])}) | {len(ratios)} | {statistics.median(ratios):.2f} | {min(ratios):.2f} | {behind} |"
        )
    return lines


def anchor(title):
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -")
    return kept.replace(" ", "-")


def table(rows):
    lines = ["| work | peer | apsides | peer's | ratio | accuracy |", "| --- | --- | ---: | ---: | ---: | --- |"]
    for row in rows:
        ours, theirs = (f"{time(row[key])} {row['unit']}" for key in ("apsides", "other"))
        lines.append(f"| {row['work']} | {row['peer']} | {ours} | {theirs} | {ratio(row):.2f} | {row['accuracy']} |")
    return lines


def plain(topic):
    """A table of figures of apsides alone."""
    rule = ["---", *("---:" for _ in topic["heading"][1:])]
    return ["| " + " | ".join(cells) + " |" for cells in (topic["heading"], rule, *topic["lines"])]


def page(summary):
    """The text of the page."""
    topics = [topic for topic in summary["topics"] if topic.get("rows")]
    alone = [topic for topic in summary["topics"] if topic.get("lines")]
    lines = [HEAD, f"Date {summary['date']}, {summary['machine']}; {summary['versions']}.", "", *overview(topics), ""]
    behind = sorted((row for topic in topics for row in topic["rows"] if ratio(row) < 1.0), key=ratio)
    if behind:
        lines += ["## Works in which a peer is ahead", "", *table(behind), ""]
    for topic in topics:
        lines += [f"## {topic['topic']}", "", topic["note"], "", *table(topic["rows"]), ""]
    for topic in alone:
        lines += [f"## {topic['topic']}", "", topic["note"], "", *plain(topic), ""]
    return "\n".join(lines)
