"""Write docs/faults.md from what benchmarks/faults kept; nothing is tried here."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.faults.places import REFUSED, WENT_ON

BENCHMARKS = Path(__file__).resolve().parents[1]
LONGEST = 200  # of longer messages the beginning is kept

HEAD = """# What becomes of a campaign that is disturbed

<!-- Written by benchmarks/faults/page.py from benchmarks/results/faults.json. -->

Programs are killed, disks fill up and files get damaged. This must not lead to wrong numbers that nobody notices. To
test this, a campaign of {results} files with every kind of result, including its deposit, was disturbed
{trials} times. After each disturbance these statements must hold:

- every result that is there is, byte for byte, that of an undisturbed campaign: no half-written file passes for whole;
- after kills, power cuts and on full disks, no process of the disturbed call is left running after {moment:.0f} s;
- after kills, what was complete is not computed again;
- the same command, given again with nothing else done, goes on to the end, and all results have the bytes of the
  undisturbed campaign; or, where this is impossible, it says what you have to do.

{verdict}

{table}

*Went on*: the call, or the next one, finished with identical bytes. *Said what to do*: the call was refused or failed
with a message that names the reason; once the reason was removed, the same command finished with identical bytes.
*Wrong*: anything else.
"""

PARTS = {
    "kill": """## Kills

`kill -9`, to which no program can react, at random moments: of Snakemake alone, of Snakemake with its whole session, of
a job, of the process from which jobs are forked, and of `icha run`. Calls that go on after a kill are killed again, up
to three times in a row. A job ends when its Snakemake ends, and Snakemake when its `icha run` ends, so the next call
never meets jobs of the last one. Should one go on all the same, on another machine for one, it can complete nothing:
the call that began last owns the results.""",
    "power cut": """## Power cuts

The working folder is on a disk of its own, whose power is cut at a random moment: whatever was not forced to the disk
by then is lost (ext4 is told to shut down without writing its journal, and is mounted again). The file system is set to
what is hardest for programs: after a cut, a file may have its new name and none of its content
(`data=writeback,noauto_da_alloc`). Results are forced to the disk before they get their names.""",
    "full disk": """## Full disks

The results, or the whole working folder, are on a disk that is full from the start, too small for what is computed, or
filled by something else while the campaign runs.""",
    "read-only": """## Where nothing can be written

The results, or the whole working folder, are on a disk that is mounted read-only, or the results may not be written to.
A finished campaign is recognised as finished. If something is missing or damaged, there is a message and nothing is
computed. Where Snakemake's own records are read-only, there is always a message, since Snakemake cannot start without
writing there.""",
    "odd place": """## Odd places

Folders with spaces, quotes and other characters in their names that mean something to a shell; a folder for temporary
files whose path is too long for a socket; files by the names of modules of Python in the working folder; and files and
links where folders are to be.""",
    "damage": """## Damaged files

A file of a finished campaign is emptied, cut in half, loses its last byte, or has one bit flipped at its start, in its
middle or at its end. This is done to each kind of file alone, in some of these ways, and to all kinds at once. A
damaged file is set aside under another name. *By the disk* means that the size and the time of the file do not show the
damage; the job that reads the file finds it.""",
    "other settings": """## Results of other settings

Snakemake is killed while it computes with another modulus, and the next call is given at once. Or results of another
modulus are put in the place of those that were asked for, as from a backup: all of them or one run, with and without
the records that Snakemake and ICHA keep. Every result knows what was asked of its job, and from which content of which
other results it was made; both are compared with what is asked for and with what is there. Without Snakemake's records
a deposit is refused, and the message says how to have them written again.""",
    "two at once": """## Two calls at once

Two calls of one campaign in one folder, the second after a random pause; and calls of two campaigns in one folder.""",
}

TAIL = """## How

`make faults` makes all trials, from the committed state of the program, and writes this page. It takes an hour or two
on two cores and needs Linux and the right to mount disks (root; without power cuts, user namespaces). The parts can be
run one by one, as was done here: `make faults OPTIONS='--parts kill'`. Moments and bits are drawn at random with seed
{seed}. Power cuts are those of a file system that is told to stop, not of a machine: what a disk loses that has said
that it has written is not among the trials.{untried}
"""


def page(kept: dict) -> str:
    """The page as Markdown."""
    rows = kept["rows"]
    trials = sum(row["trials"] for row in rows)
    wrong = sum(_wrong(row) for row in rows)
    failed = f"**They failed in {wrong} of {trials} trials:** see below."
    verdict = failed if wrong else f"They held in all {trials} trials."
    text = HEAD.format(
        results=kept["results"], trials=trials, moment=kept["moment"], verdict=verdict, table=_totals(rows)
    )
    for part, words in PARTS.items():
        own = [row for row in rows if row["part"] == part]
        if not own:
            continue
        text += f"\n{words}\n\n{_table(own)}\n"
        messages = dict.fromkeys(_whole(message) for row in own for message in row["messages"])
        if messages:
            text += "\nWhat was said:\n\n```text\n" + "\n".join(messages) + "\n```\n"
        violations = [f"- {row['fault']}: {violation}" for row in own for violation in row["violations"]]
        if violations:
            text += "\nWhat was wrong:\n\n" + "\n".join(violations) + "\n"
    untried = ", ".join(part for part in PARTS if not any(row["part"] == part for row in rows))
    untried = f" Not tried by the version that wrote this page: {untried}." if untried else ""
    return text + "\n" + TAIL.format(seed=kept["seed"], untried=untried)


def _whole(message):
    return message + "…" if len(message) == LONGEST else message


def _wrong(row):
    return row["trials"] - row[WENT_ON] - row[REFUSED]


def _totals(rows):
    lines = []
    for part in PARTS:
        own = [row for row in rows if row["part"] == part]
        if not own:
            continue
        sums = [sum(count(row) for row in own) for count in _COUNTS]
        lines.append([part, *map(str, sums)])
    return _lines([["disturbance", "trials", WENT_ON, REFUSED, "wrong"], *lines])


_COUNTS = (lambda row: row["trials"], lambda row: row[WENT_ON], lambda row: row[REFUSED], _wrong)


def _table(rows):
    lines = [[row["fault"], *(str(count(row)) for count in _COUNTS)] for row in rows]
    return _lines([["of what", "trials", WENT_ON, REFUSED, "wrong"], *lines])


def _lines(rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in [rows[0], ["---"] + ["---:"] * 4, *rows[1:]])


if __name__ == "__main__":
    written = json.loads((BENCHMARKS / "results/faults.json").read_text(encoding="utf-8"))
    (BENCHMARKS.parent / "docs/faults.md").write_text(page(written), encoding="utf-8")
