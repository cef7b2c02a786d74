"""Types requests of local control at a terminal, as a person does.

    typed.py PROGRAM SOCKET

Enables the axis "turntable", sends it on a long move, stops it while it moves, and ends the input. Prints one JSON object: what the
program has shown, and its exit status.
"""

import json
import os
import pty
import select
import sys
import time

program, socket = sys.argv[1:3]
pid, terminal = pty.fork()
if pid == 0:
    os.execv(program, [program, "control", "--local", socket])

text = b""


def until(wanted: bytes) -> None:
    global text
    end = time.monotonic() + 20
    while wanted not in text:
        if time.monotonic() > end:
            sys.exit(f"no {wanted!r}: {text!r}")
        if select.select([terminal], [], [], 0.1)[0]:
            text += os.read(terminal, 4096)


os.write(terminal, b"enable turntable\n")
until(b"ok enable turntable")
os.write(terminal, b"move turntable 50 velocity=0.5 acceleration=20\n")
time.sleep(0.5)
os.write(terminal, b"stop turntable\n")
until(b"ok stop turntable")
os.write(terminal, b"\x04")
try:
    while chunk := os.read(terminal, 4096):
        text += chunk
except OSError:
    pass
_, status = os.waitpid(pid, 0)
print(json.dumps({"shown": text.decode(), "status": os.waitstatus_to_exitcode(status)}))
