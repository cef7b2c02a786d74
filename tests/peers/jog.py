"""Jogs an axis by the keys of a terminal, as a person does.

    jog.py PROGRAM SOCKET AXIS VELOCITY KEY SECONDS [hang-up]

Holds KEY for SECONDS, releases it, and looks on; then it presses q, or with hang-up closes the terminal while the key is held. Prints
one JSON object: the positions at the beginning, at the release and twice afterwards, the largest velocity, and the exit status.
"""

import json
import os
import pty
import re
import select
import sys
import time

program, socket, axis, velocity, key, seconds = sys.argv[1:7]
hang_up = sys.argv[7:] == ["hang-up"]
keys = {"right": b"\x1b[C", "left": b"\x1b[D"}[key]

pid, terminal = pty.fork()
if pid == 0:
    os.execv(program, [program, "control", "--local", socket, "--jog", axis, "--velocity", velocity])

text = b""


def look(patience: float) -> None:
    """Reads what is shown for so long."""
    global text
    end = time.monotonic() + patience
    while (rest := end - time.monotonic()) > 0:
        ready, _, _ = select.select([terminal], [], [], rest)
        if ready:
            try:
                text += os.read(terminal, 4096)
            except OSError:
                return


def position() -> float:
    found = re.findall(rb"position=(-?[0-9.]+)", text)
    if not found:
        sys.exit(f"no position is shown: {text.decode(errors='replace')}")
    return float(found[-1])


end = time.monotonic() + 20
while b"state=operating" not in text and time.monotonic() < end:
    look(0.1)
first = position()
held = time.monotonic() + float(seconds)
while time.monotonic() < held:
    os.write(terminal, keys)
    look(0.05)
if hang_up:
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    print(json.dumps({"first": first, "status": status}))
    sys.exit(0)
released = position()
# The jog ends 500 ms after the last key; then the axis brakes.
look(1.5)
stopped = position()
look(0.5)
last = position()
os.write(terminal, b"q")
look(3.0)
_, status = os.waitpid(pid, 0)
# A host that pauses lets the axis overshoot for a moment: most of what was shown is the speed.
speeds = [float(one) for one in re.findall(rb"velocity=(-?[0-9.]+)", text)]
moving = sorted(one for one in speeds if abs(one) > 0.1)
print(json.dumps({
    "first": first, "released": released, "stopped": stopped, "last": last,
    "speed": moving[len(moving) // 2] if moving else 0.0, "status": os.waitstatus_to_exitcode(status),
}))
