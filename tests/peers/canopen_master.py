"""A small CANopen master on the bare package `python-can`: a foreign opponent for the simulated drive.

    canopen_master.py INTERFACE NODE [--period SECONDS] [--cycles N]

Boots the node, writes and reads back its mapping, leads it along a sine in csp on SYNC, raises a fault by 2FFF:01 (unless
--no-fault) and clears it. Prints what it sees, one "key value" a line; status 0 if the drive did as it should.
"""

import argparse
import math
import struct
import sys
import time

import can

parser = argparse.ArgumentParser()
parser.add_argument("interface")
parser.add_argument("node", type=int)
parser.add_argument("--period", type=float, default=0.02)
parser.add_argument("--cycles", type=int, default=150)
parser.add_argument("--no-fault", action="store_true")
arguments = parser.parse_args()
node, period = arguments.node, arguments.period
bus = can.Bus(interface="socketcan", channel=arguments.interface)
failures = []


def say(key, value):
    print(key, value, flush=True)


def expect(what, holds):
    if not holds:
        failures.append(what)
        say("FAILED", what)


def send(cob, data=b""):
    bus.send(can.Message(arbitration_id=cob, data=data, is_extended_id=False))


def receive(cob, within=3.0):
    """The data of the next frame with this identifier."""
    end = time.monotonic() + within
    while (left := end - time.monotonic()) > 0:
        message = bus.recv(left)
        if message and message.arbitration_id == cob:
            return bytes(message.data)
    sys.exit(f"no frame {cob:03X} within {within} s")


def write(index, sub, value, size):
    """Expedited download; the abort code, or None."""
    data = (value & ((1 << 8 * size) - 1)).to_bytes(4, "little")
    send(0x600 + node, struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + data)
    answer = receive(0x580 + node)
    expect(f"answer for {index:04X}:{sub:02X}", answer[1:4] == struct.pack("<HB", index, sub))
    return struct.unpack_from("<I", answer, 4)[0] if answer[0] == 0x80 else None


def must_write(index, sub, value, size):
    code = write(index, sub, value, size)
    expect(f"{index:04X}:{sub:02X} written ({code})", code is None)


def read(index, sub=0, optional=False):
    """Upload, expedited or segmented; bytes."""
    send(0x600 + node, struct.pack("<BHB4x", 0x40, index, sub))
    answer = receive(0x580 + node)
    if answer[0] == 0x80:
        if optional:
            return None
        sys.exit(f"{index:04X}:{sub:02X} aborted with {struct.unpack_from('<I', answer, 4)[0]:08X}")
    if answer[0] & 0x02:
        return answer[4 : 8 - (answer[0] >> 2 & 3)]
    data, toggle = b"", 0
    while True:
        send(0x600 + node, bytes([0x60 | toggle]) + bytes(7))
        answer = receive(0x580 + node)
        expect("toggle bit", answer[0] & 0xF0 == toggle)
        data += answer[1 : 8 - (answer[0] >> 1 & 7)]
        if answer[0] & 1:
            return data
        toggle ^= 0x10


def number(index, sub=0):
    return int.from_bytes(read(index, sub), "little")


send(0x000, [0x82, node])
expect("boot-up", receive(0x700 + node, 8.0) == b"\x00")
say("type", f"{number(0x1000):08X}")
say("modes", f"{number(0x6502):X}")
say("vendor", f"{number(0x1018, 1):X}")
name = read(0x1008, optional=True)
if name is not None:
    say("name", name.decode())

# What must be refused: an object that is not there, a mapping that is in use.
say("missing", f"{write(0x5FFF, 0, 0, 1) or 0:08X}")
expect("a mapping in use is refused", write(0x1600, 1, 0x607A0020, 4) is not None)
for comm, cob, fields in ((0x1400, 0x200, (0x60400010, 0x607A0020)), (0x1800, 0x180, (0x60410010, 0x60640020))):
    rtr = 0x40000000 if comm == 0x1800 else 0
    must_write(comm, 1, 0x80000000 | rtr | cob + node, 4)
    must_write(comm, 2, 1, 1)
    must_write(comm + 0x200, 0, 0, 1)
    for place, field in enumerate(fields):
        must_write(comm + 0x200, place + 1, field, 4)
    must_write(comm + 0x200, 0, len(fields), 1)
    must_write(comm, 1, rtr | cob + node, 4)
    expect("mapping read back", [number(comm + 0x200, k + 1) for k in range(2)] == list(fields))
must_write(0x60C2, 1, round(period * 1000), 1)
must_write(0x60C2, 2, -3, 1)
must_write(0x6060, 0, 8, 1)
send(0x000, [0x01, node])

control, target, start = 0, None, None
seen, state, position, worst = 0, 0, 0, 0
targets = []
wake = time.monotonic()
for cycle in range(arguments.cycles):
    send(0x200 + node, struct.pack("<Hi", control, target or 0))
    send(0x080)
    wake += period
    status = None
    while (left := wake - time.monotonic()) > 0:
        message = bus.recv(left)
        if message and message.arbitration_id == 0x180 + node:
            status = bytes(message.data)
    if status is None:
        continue
    seen += 1
    word, position = struct.unpack("<Hi", status)
    state = word & 0x6F
    if target is None or state != 0x27:
        target = position
    if state & 0x4F == 0x40:
        control = 0x06
    elif state == 0x21:
        control = 0x07
    elif state == 0x23:
        control = 0x0F
    elif state == 0x27:
        start = start if start is not None else (cycle, position)
        targets.append(target)
        target = start[1] + int(10000 * math.sin((cycle - start[0]) / 20))
        if len(targets) > 20:
            worst = max(worst, min(abs(position - old) for old in targets[-20:]))
say("tpdos", f"{seen} of {arguments.cycles}")
say("state", f"{state:02X}")
say("way", max(targets, default=0) - min(targets, default=0))
say("worst", worst)
expect("TPDOs", seen > arguments.cycles // 2)
expect("operation enabled", state == 0x27)
expect("moved", max(targets, default=0) - min(targets, default=0) > 10000)
expect("follows", worst < 1500)

if not arguments.no_fault:
    must_write(0x2FFF, 1, 0x7305, 2)
    # The emergency may have come before the answer.
    deadline = time.monotonic() + 3
    while number(0x6041) & 0x4F != 0x08 and time.monotonic() < deadline:
        time.sleep(0.02)
    say("error", f"{number(0x603F):04X}")
    expect("fault", number(0x6041) & 0x4F == 0x08 and number(0x603F) == 0x7305)
    must_write(0x6060, 0, 8, 1)
    for word in (0x0000, 0x0080):
        send(0x200 + node, struct.pack("<Hi", word, position))
        send(0x080)
        time.sleep(period)
    send(0x080)
    time.sleep(period)
    say("cleared", f"{number(0x6041) & 0x4F:02X}")
    expect("fault reset", number(0x6041) & 0x4F == 0x40)

send(0x000, [0x80, node])
bus.shutdown()
sys.exit(1 if failures else 0)
