"""Gives programs of the LinuxCNC dialect to LinuxCNC's own interpreter, and holds the motions that it reads against ours.

    python3 tests/linuxcnc.py PROGRAM.nc SUMMARY.json ...

SUMMARY.json is what `servosim toolpath --format json` printed of the program. Needs `rs274` (package linuxcnc-uspace).
"""

import json
import math
import re
import subprocess
import sys

MOTION = re.compile(r"(STRAIGHT_FEED|STRAIGHT_TRAVERSE)\(([^)]*)\)")


def motions(program):
    """Kind and end of every motion, as the interpreter has them."""
    done = subprocess.run(["rs274", "-g", program], capture_output=True, text=True, timeout=300, check=False)
    end = done.stdout.strip().splitlines()
    assert done.returncode == 0 and any("PROGRAM_END" in line for line in end), (
        f"{program} is refused: {done.stderr[-500:]} {end[-3:]}"
    )
    found = MOTION.findall(done.stdout)
    return [(kind, [float(number) for number in numbers.split(",")[:3]]) for kind, numbers in found]


def check(program, summary):
    with open(summary, encoding="utf-8") as file:
        ours = json.load(file)
    theirs = motions(program)
    feeds = [end for kind, end in theirs if kind == "STRAIGHT_FEED"]
    assert len(feeds) == ours["straight_blocks"], (len(feeds), ours["straight_blocks"])
    assert len(theirs) - len(feeds) == ours["rapid_blocks"], (len(theirs), ours["rapid_blocks"])
    length = sum(math.dist(a, b) for (_, a), (kind, b) in zip(theirs, theirs[1:]) if kind == "STRAIGHT_FEED")
    print(f"{program}: {len(feeds)} feeds of {length:.3f} mm, {len(theirs) - len(feeds)} rapids")
    # The interpreter prints four decimals.
    assert abs(length / ours["feed_length_mm"] - 1.0) < 1e-5, (length, ours["feed_length_mm"])


arguments = sys.argv[1:]
for program, summary in zip(arguments[::2], arguments[1::2]):
    check(program, summary)
