"""A master on PyPI's `canopen` with its profile for CiA 402 drives: a foreign opponent for the simulated drive.

    canopen_remote.py INTERFACE NODE EDS

Finds one device without a node-id by LSS fastscan and gives it NODE, then tries SDO, PDO, NMT, heartbeats, EMCY and the modes of
operation with it, by the names and types of its data sheet. Prints what it sees, one "key value" a line; status 0 if the device
did as it should.
"""

import sys
import time

import canopen
from canopen.profiles.p402 import BaseNode402

interface, number, eds = sys.argv[1], int(sys.argv[2]), sys.argv[3]
PERIOD = 0.02
OWN = 126
failures = []


def say(key, value):
    print(key, value, flush=True)


def expect(what, holds):
    if not holds:
        failures.append(what)
        say("FAILED", what)


def until(what, holds, within=10.0):
    end = time.monotonic() + within
    while not holds():
        if time.monotonic() > end:
            say("FAILED", f"{what}: {node.statusword:04X} {dict(node.tpdo_values)} {states[-3:]} {errors}")
            sys.exit(1)
        time.sleep(PERIOD / 2)


def code(action):
    """The code that an access is aborted with; 0 for none."""
    try:
        action()
    except canopen.SdoAbortedError as error:
        return error.code
    return 0


def put(index, sub, data):
    return lambda: node.sdo.download(index, sub, data)


class Node(BaseNode402):
    def check_statusword(self, timeout=None):
        """What is sent in an RPDO counts from the next SYNC, and is seen after one more: the package waits for a single TPDO."""
        for _ in range(2):
            super().check_statusword(timeout)
        return super().check_statusword(timeout)


network = canopen.Network()
network.connect(interface="socketcan", channel=interface)
node = Node(number, eds)
node.sdo.RESPONSE_TIMEOUT = 3.0
node.TIMEOUT_SWITCH_STATE_SINGLE = node.TIMEOUT_SWITCH_STATE_FINAL = 5.0
node.TIMEOUT_SWITCH_OP_MODE = node.TIMEOUT_CHECK_TPDO = 5.0
network.add_node(node)
states, errors = [], []
node.nmt.add_heartbeat_callback(states.append)
node.emcy.add_callback(lambda error: errors.append((error.code, error.register)))

# LSS. A bit that is not answered for is one.
network.lss.RESPONSE_TIMEOUT = 0.1
found, deadline = False, time.monotonic() + 20
while not found and time.monotonic() < deadline:  # it may not be there yet
    found, address = network.lss.fast_scan()
say("address", " ".join(f"{part:X}" for part in address) if found else "none")
network.lss.RESPONSE_TIMEOUT = 3.0
expect("the scan has selected it", network.lss.inquire_lss_address(0x5A) == address[0])
expect("no node-id yet", network.lss.inquire_node_id() == 0xFF)
network.lss.configure_node_id(number)
network.lss.send_switch_state_global(network.lss.WAITING_STATE)
until("boot-up", lambda: states == [0])

# SDO: expedited and segmented, named by the data sheet.
say("type", f"{node.sdo['Device type'].raw:08X}")
say("name", node.sdo[0x1008].raw)
say("serial", f"{node.sdo[0x1018][4].raw:X}")
for index, value in ((0x6098, 35), (0x605A, 6), (0x607C, -123456), (0x6081, 3_000_000_000)):
    node.sdo[index].raw = value
    expect(f"{index:04X} read back", node.sdo[index].raw == value)
node.sdo[0x605A].raw = 2
for length in (0, 1, 4, 5, 7, 8, 889, 890, 4096):
    data = bytes(7 * place % 251 for place in range(length))
    if length:
        node.sdo.download(0x2FFE, 0, data, force_segment=True)
        expect(f"{length} bytes in segments", node.sdo.upload(0x2FFE, 0) == data)
        with node.sdo.open(0x2FFE, 0, "wb", size=length, block_transfer=True) as writer:
            writer.write(data[::-1])
        with node.sdo.open(0x2FFE, 0, "rb", block_transfer=True) as reader:
            expect(f"{length} bytes in blocks", reader.read() == data[::-1])
refused = (
    code(put(0x5FFF, 0, b"\0")), code(put(0x6081, 1, b"\0")), code(put(0x6041, 0, b"\0\0")),
    code(put(0x6060, 0, b"\x05")), code(put(0x6081, 0, b"\0\0")), code(put(0x6081, 0, b"\0\0\0\0\0")),
    code(put(0x1600, 1, b"\x20\0\x7A\x60")), code(lambda: node.sdo.download(0x2FFE, 0, bytes(4097))),
)  # fmt: skip
say("refused", " ".join(f"{each:08X}" for each in refused))

# PDO: mapping written and read back by the package; what it sends and sees follows SYNC.
node.tpdo.read()
node.rpdo.read()
for pdos, mapping in ((node.rpdo, ((0x6040, 0x607A, 0x6060), (0x60FF, 0x6071))), (node.tpdo, ((0x6041, 0x6064, 0x6061), (0x606C, 0x6077)))):
    for place, indices in enumerate(mapping, 1):
        pdos[place].clear()
        for index in indices:
            pdos[place].add_variable(index)
        pdos[place].trans_type, pdos[place].enabled = 1, True
        pdos[place].save()
node.tpdo.read()
node.rpdo.read()
say("mapped", " ".join(f"{variable.index:04X}" for pdo in (node.rpdo[1], node.rpdo[2], node.tpdo[1], node.tpdo[2]) for variable in pdo))
node.sdo[0x60C2][1].raw, node.sdo[0x60C2][2].raw = round(PERIOD * 1000), -3

# NMT and heartbeats.
node.sdo[0x1017].raw = 50
for command, shown in (("OPERATIONAL", 5), ("STOPPED", 4), ("PRE-OPERATIONAL", 127)):
    node.nmt.state = command
    until(command, lambda: states[-1] == shown)
    if command == "STOPPED":
        node.sdo.RESPONSE_TIMEOUT = 0.3
        try:
            node.sdo[0x1000].raw
            expect("no SDO when stopped", False)
        except canopen.SdoCommunicationError:
            pass
        node.sdo.RESPONSE_TIMEOUT = 3.0
node.setup_402_state_machine()
node.nmt.state = "OPERATIONAL"
until("OPERATIONAL", lambda: states[-1] == 5)
network.sync.start(PERIOD)
for place in (1, 2):
    node.rpdo[place].start(PERIOD)


def shown(index):
    return node.tpdo_values[index]


def give(index, value):
    node.rpdo_pointers[index].raw = value


def enable(mode):
    """Enabled in a mode; the target is where the drive stands."""
    node.state = "SWITCH ON DISABLED"
    for index in (0x60FF, 0x6071):
        give(index, 0)
    node.op_mode = mode
    expect(mode, node.op_mode == mode)
    node.check_statusword()
    give(0x607A, shown(0x6064))
    node.state = "OPERATION ENABLED"


# The state machine, step by step and by the way that the package knows.
until("TPDOs", lambda: shown(0x6041) != 0)
seen = []
for state in ("READY TO SWITCH ON", "SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"):
    node.state = state
    seen.append(node.state)
enable("PROFILED POSITION")
seen.append(node.state)
for state in ("SWITCHED ON", "OPERATION ENABLED", "READY TO SWITCH ON"):
    node.state = state
    seen.append(node.state)
say("states", ", ".join(seen))
try:
    node.op_mode = "OPEN LOOP SCALAR MODE"
except (KeyError, TypeError):
    say("mode", "refused")

# pp.
node.sdo[0x6081].raw, node.sdo[0x6083].raw, node.sdo[0x6084].raw = 200_000, 2_000_000, 2_000_000
enable("PROFILED POSITION")
start = shown(0x6064)
give(0x607A, start + 50_000)
node.controlword = 0x1F
until("set-point taken", lambda: shown(0x6041) & 0x1000)
node.controlword = 0x0F
until("target reached", lambda: shown(0x6041) & 0x1400 == 0x0400)
expect("pp", abs(shown(0x6064) - start - 50_000) < 100)

# pv.
enable("PROFILED VELOCITY")
give(0x60FF, -100_000)
until("velocity reached", lambda: shown(0x6041) & 0x0400 and abs(shown(0x606C) + 100_000) < 10_000)
give(0x60FF, 0)
until("stand", lambda: shown(0x6041) & 0x1000)

# hm: at the current position, whose name is the home offset.
node.sdo[0x607C].raw = 4242
node.state = "SWITCH ON DISABLED"
expect("homed", node.homing(timeout=10))
until("home", lambda: abs(shown(0x6064) - 4242) < 100)
expect("is homed", node.is_homed())
node.controlword = 0x0F

# csp: a ramp of 10 turns in 200 periods; csv; cst.
enable("CYCLIC SYNCHRONOUS POSITION")
start = shown(0x6064)
for step in range(1, 101):
    give(0x607A, start + 1_000 * step)
    node.tpdo[1].wait_for_reception(5.0)
until("csp", lambda: abs(shown(0x6064) - start - 100_000) < 100)
expect("csp follows", shown(0x6041) & 0x3000 == 0x1000)
enable("CYCLIC SYNCHRONOUS VELOCITY")
give(0x60FF, 150_000)
until("csv", lambda: abs(shown(0x606C) - 150_000) < 15_000)
give(0x60FF, 0)
until("stand", lambda: abs(shown(0x606C)) < 5_000)
enable("CYCLIC SYNCHRONOUS TORQUE")
start = shown(0x606C)
give(0x6071, 100)
until("cst", lambda: shown(0x606C) - start > 50_000 and 50 < shown(0x6077) < 150)
give(0x6071, 0)
until("no torque", lambda: abs(shown(0x6077)) < 20)

# EMCY: a fault, its history, and the way out of it.
enable("PROFILED VELOCITY")
errors.clear()
node.sdo[0x2FFF][1].raw = 0x7305
until("FAULT", lambda: node.state == "FAULT")
until("EMCY", lambda: errors)
say("error", f"{errors[0][0]:04X} {errors[0][1]:02X} {node.sdo[0x603F].raw:04X} {node.sdo[0x1003][1].raw & 0xFFFF:04X} {node.sdo[0x1001].raw:02X}")
node.reset_from_fault()
say("after", node.state)
until("EMCY gone", lambda: errors[-1] == (0, 0))

# Heartbeat consumer: the drive stops by itself when this master falls silent.
errors.clear()
node.sdo[0x1016][1].raw = OWN << 16 | 500
beat = network.send_periodic(0x700 + OWN, [5], 0.1)
time.sleep(0.3)
expect("watched", node.state == "OPERATION ENABLED" and not errors)
beat.stop()
until("EMCY", lambda: len(errors) > 1)
until("pre-operational", lambda: states[-1] == 127)
say("silence", " ".join(f"{code:04X}" for code, _ in errors) + f" {node.sdo[0x6041].raw & 0x4F:02X}")
errors.clear()
beat = network.send_periodic(0x700 + OWN, [5], 0.1)
until("heard again", lambda: errors)
node.nmt.state = "OPERATIONAL"
until("FAULT", lambda: node.state == "FAULT")
node.reset_from_fault()
expect("enabled again", node.state == "OPERATION ENABLED")

# Reset: boot-up, in pre-operational, and what was written by SDO is gone.
node.state = "SWITCH ON DISABLED"
network.sync.stop()
for place in (1, 2):
    node.rpdo[place].stop()
states.clear()
node.nmt.state = "RESET"
until("boot-up", lambda: 0 in states)
expect("defaults", node.sdo[0x607C].raw == 0 and node.sdo[0x1017].raw == 0)
beat.stop()
network.disconnect()
sys.exit(1 if failures else 0)
