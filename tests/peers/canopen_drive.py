"""A CiA 402 servo drive as a CANopen node, on the packages `canopen` and `python-can`: a foreign opponent for the master.

    canopen_drive.py INTERFACE NODE [--heartbeat MS]

SDO (expedited, segmented), NMT, heartbeat producer and consumer, EMCY, four RPDOs and four TPDOs with free mapping, SYNC; pp, pv,
hm (35, 37), csp, csv, cst. An error code written to 2FFF:01 raises that fault, 1 written to 2FFF:02 stops the heartbeat until 0
is or the node is reset. Each change of state is one line on standard output.
"""

import argparse
import struct
import threading
import time

import canopen
from canopen.objectdictionary import ODRecord, ODVariable, datatypes
from canopen.sdo import SdoAbortedError

KINDS = {  # name: data type of the package, format of struct
    "u8": (datatypes.UNSIGNED8, "<B"),
    "u16": (datatypes.UNSIGNED16, "<H"),
    "u32": (datatypes.UNSIGNED32, "<I"),
    "i8": (datatypes.INTEGER8, "<b"),
    "i16": (datatypes.INTEGER16, "<h"),
    "i32": (datatypes.INTEGER32, "<i"),
}

# index, sub-index (- for a plain variable), kind, access, default; five words each
OBJECTS = """
1000 - u32 ro 0x20192      1001 - u8 ro 0           1005 - u32 rw 0x80        1006 - u32 rw 0
1014 - u32 rw 0x80+node    1016 1 u32 rw 0          1017 - u16 rw 0           1018 1 u32 ro 0x7FFFFFF0
1018 2 u32 ro 0x402        1018 3 u32 ro 0x10000    1018 4 u32 ro 0x1000+node 1019 - u8 rw 0
2FFF 1 u16 rw 0            2FFF 2 u8 rw 0           603F - u16 ro 0           6040 - u16 rw 0
6041 - u16 ro 0            605A - i16 rw 2          605B - i16 rw 0           605C - i16 rw 1
605D - i16 rw 1            605E - i16 rw 2          6060 - i8 rw 0            6061 - i8 ro 0
6064 - i32 ro 0            6065 - u32 rw 0xFFFFFFFF 6066 - u16 rw 0           6067 - u32 rw 10
606C - i32 ro 0            6071 - i16 rw 0          6072 - u16 rw 3000        6075 - u32 rw 5000
6076 - u32 rw 1000         6077 - i16 ro 0          607A - i32 rw 0           607C - i32 rw 0
607D 1 i32 rw -2**31       607D 2 i32 rw 2**31-1    6080 - u32 rw 6000        6081 - u32 rw 100000
6083 - u32 rw 1000000      6084 - u32 rw 1000000    6085 - u32 rw 5000000     608F 1 u32 rw 65536
608F 2 u32 rw 1            6091 1 u32 rw 1          6091 2 u32 rw 1           6092 1 u32 rw 65536
6092 2 u32 rw 1            6098 - i8 rw 35          60B0 - i32 rw 0           60B1 - i32 rw 0
60B2 - i16 rw 0            60C2 1 u8 rw 10          60C2 2 i8 rw -3           60F4 - i32 ro 0
60FD - u32 ro 0            60FF - i32 rw 0          6502 - u32 ro 0x3A5
"""

PDOS = range(4)
NOT_VALID = 0x8000_0000
DEFAULT_RPDOS = [[0x60400010], [0x60400010, 0x60600008], [0x60400010, 0x607A0020], [0x60400010, 0x60FF0020]]
DEFAULT_TPDOS = [[0x60410010], [0x60410010, 0x60610008], [0x60410010, 0x60640020], [0x60410010, 0x606C0020]]

# States by the value of the statusword.
NOT_READY, DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, REACTION, FAULT = 0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
NAMES = {
    NOT_READY: "not ready", DISABLED: "switch on disabled", READY: "ready to switch on", SWITCHED_ON: "switched on",
    ENABLED: "operation enabled", QUICK_STOP: "quick stop active", REACTION: "fault reaction active", FAULT: "fault",
}  # fmt: skip
MODES = (0, 1, 3, 6, 8, 9, 10)
METHODS = (35, 37)


def dictionary(node):
    """The object dictionary with its defaults."""
    words = OBJECTS.split()
    entries = [words[n : n + 5] for n in range(0, len(words), 5)]
    for n in PDOS:
        off = 0 if n == 0 else NOT_VALID
        entries += [(f"{0x1400 + n:X}", 1, "u32", "rw", off | (0x200 + 0x100 * n + node)), (f"{0x1400 + n:X}", 2, "u8", "rw", 255)]
        entries += [(f"{0x1800 + n:X}", 1, "u32", "rw", off | 0x4000_0000 | (0x180 + 0x100 * n + node))]
        entries += [(f"{0x1800 + n:X}", sub, kind, "rw", value) for sub, kind, value in ((2, "u8", 255), (3, "u16", 0), (5, "u16", 0))]
        for base, fields in ((0x1600, DEFAULT_RPDOS[n]), (0x1A00, DEFAULT_TPDOS[n])):
            padded = fields + [0] * (8 - len(fields))
            entries += [(f"{base + n:X}", k + 1, "u32", "rw", value) for k, value in enumerate(padded)]
            entries.append((f"{base + n:X}", 0, "u8", "rw", len(fields)))
    od = canopen.ObjectDictionary()
    od.node_id = node
    for index, sub, kind, access, value in entries:
        index = int(index, 16)
        value = eval(value, {"node": node}) if isinstance(value, str) else value
        sub = None if sub == "-" else int(sub)
        variable = ODVariable(f"{index:04X}:{sub or 0:02X}", index, sub or 0)
        variable.data_type, variable.access_type = KINDS[kind][0], access
        variable.default = variable.value = value
        variable.pdo_mappable = index >= 0x6000
        if sub is None:
            od.add_object(variable)
            continue
        if index not in od:
            record = ODRecord(f"{index:04X}", index)
            count = ODVariable("count", index, 0)
            count.data_type, count.access_type = datatypes.UNSIGNED8, "ro"
            count.default = count.value = 0
            record.add_member(count)
            od.add_object(record)
        record = od[index]
        if sub == 0:
            record[0].access_type, record[0].default, record[0].value = access, value, value
        else:
            record.add_member(variable)
            if record[0].access_type == "ro":
                record[0].default = record[0].value = max(record[0].value, sub)
    return od


class Drive:
    def __init__(self, interface, node, heartbeat):
        self.id = node
        self.lock = threading.RLock()
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel=interface)
        self.node = canopen.LocalNode(node, dictionary(node))
        self.network.add_node(self.node)
        self.formats = {kind: text for kind, text in KINDS.values()}
        self.subscriptions = {}
        self.watched = None  # what the heartbeat consumer listens to, and until when
        self.reset()
        self.node.add_write_callback(self.written)
        self.network.subscribe(0x000, lambda cob, data, at: self.command(bytes(data)))
        self.network.subscribe(0x080, lambda cob, data, at: self.sync())
        if heartbeat:
            self.set(0x1017, heartbeat)
        self.boot()
        threading.Thread(target=self.run, daemon=True).start()

    def reset(self):
        self.state, self.control, self.bits = NOT_READY, 0, 0
        self.position, self.velocity, self.torque = 0.0, 0.0, 0
        self.target, self.homed_at, self.off_since = None, None, None
        self.latched, self.last_sent, self.syncs = {}, {}, 0

    # Objects by value.

    def object(self, index, sub):
        entry = self.node.object_dictionary[index]
        return entry if isinstance(entry, ODVariable) else entry[sub]

    def get(self, index, sub=0):
        text = self.formats[self.object(index, sub).data_type]
        return struct.unpack(text, self.node.get_data(index, sub))[0]

    def set(self, index, value, sub=0):
        text = self.formats[self.object(index, sub).data_type]
        bits = 8 * struct.calcsize(text)
        value = int(value) & ((1 << bits) - 1)
        self.node.data_store.setdefault(index, {})[sub] = value.to_bytes(bits // 8, "little")

    # Network management.

    @property
    def nmt(self):
        return self.node.nmt.state

    def boot(self):
        for n in PDOS:
            self.subscribe(n)
        # The package sends boot-up and heartbeats, and follows NMT commands.
        self.node.nmt.send_command(0)
        self.node.nmt.send_command(128)
        self.go(DISABLED)

    def command(self, data):
        if len(data) != 2 or data[1] not in (0, self.id):
            return
        print(f"nmt {data[0]:02X}", flush=True)
        with self.lock:
            if data[0] in (0x81, 0x82):
                self.node.nmt.stop_heartbeat()
                if data[0] == 0x81:
                    self.node.data_store.clear()
                self.reset()
                self.boot()
            elif data[0] == 0x01:
                self.last_sent = {}
                self.status()

    # Writes by SDO: what a drive refuses, and what takes effect at once.

    def written(self, index, subindex, od, data):
        value = int.from_bytes(data, "little")
        if index & 0xFFFC in (0x1600, 0x1A00):
            self.check_mapping(index, subindex, value)
        if index & 0xFFFC in (0x1400, 0x1800) and subindex == 1:
            old = self.get(index, 1)
            if not (old | value) & NOT_VALID and (old ^ value) & 0x7FF:
                raise SdoAbortedError(0x06090030)
        if index == 0x6060 and struct.unpack("b", data)[0] not in MODES:
            raise SdoAbortedError(0x06090030)
        if index == 0x6098 and struct.unpack("b", data)[0] not in METHODS:
            raise SdoAbortedError(0x06090030)
        self.node.data_store.setdefault(index, {})[subindex] = bytes(data)
        with self.lock:
            if index & 0xFFFC == 0x1400:
                self.subscribe(index & 3)
            elif index == 0x1016:
                self.watch()
            elif (index, subindex) == (0x2FFF, 1) and value:
                self.fault(value)
            elif (index, subindex) == (0x2FFF, 2):
                print("heartbeat off" if value else "heartbeat on", flush=True)
                self.node.nmt.stop_heartbeat()
                if not value:
                    self.node.nmt.start_heartbeat(self.get(0x1017))
            elif index in (0x6040, 0x6060):
                self.apply_words()

    def check_mapping(self, index, subindex, value):
        if not self.get(index - 0x200, 1) & NOT_VALID or (subindex and self.get(index, 0)):
            raise SdoAbortedError(0x06010000)
        if subindex == 0:
            if sum(self.get(index, k) & 0xFF for k in range(1, value + 1)) > 64:
                raise SdoAbortedError(0x06040042)
        elif value:
            try:
                entry = self.object(value >> 16, value >> 8 & 0xFF)
            except KeyError:
                raise SdoAbortedError(0x06020000) from None
            if not entry.pdo_mappable:
                raise SdoAbortedError(0x06040041)
            if 8 * struct.calcsize(self.formats[entry.data_type]) != value & 0xFF:
                raise SdoAbortedError(0x06040043)

    def watch(self):
        word = self.get(0x1016, 1)
        span = (word & 0xFFFF) / 1000
        if not span:
            self.watched = None
            return
        self.watched = [span, None]

        def heard(cob, data, at):
            if self.watched:
                self.watched[1] = time.monotonic() + span

        self.network.subscribe(0x700 + (word >> 16 & 0x7F), heard)

    # Process data.

    def subscribe(self, n):
        if n in self.subscriptions:
            self.network.unsubscribe(*self.subscriptions.pop(n))
        cob = self.get(0x1400 + n, 1)
        if not cob & NOT_VALID:
            self.subscriptions[n] = (cob & 0x7FF, lambda cob, data, at, n=n: self.rpdo(n, bytes(data)))
            self.network.subscribe(*self.subscriptions[n])

    def rpdo(self, n, data):
        with self.lock:
            if self.nmt != "OPERATIONAL":
                return
            fields = self.fields(0x1600 + n)
            if len(data) < sum(size for _, _, size in fields):
                self.emergency(0x8210)
            elif self.get(0x1400 + n, 2) <= 240:
                self.latched[n] = data
            else:
                self.take(fields, data)

    def fields(self, index):
        words = [self.get(index, k) for k in range(1, self.get(index, 0) + 1)]
        return [(word >> 16, word >> 8 & 0xFF, (word & 0xFF) // 8) for word in words]

    def take(self, fields, data):
        for index, sub, size in fields:
            self.node.data_store.setdefault(index, {})[sub], data = data[:size], data[size:]
        self.apply_words()

    def tpdo(self, n):
        fields = self.fields(0x1A00 + n)
        data = b"".join(self.node.get_data(index, sub) for index, sub, _ in fields)
        self.last_sent[n] = data
        self.network.send_message(self.get(0x1800 + n, 1) & 0x7FF, data)

    def valid_tpdos(self):
        return [n for n in PDOS if not self.get(0x1800 + n, 1) & NOT_VALID]

    def sync(self):
        with self.lock:
            if self.nmt != "OPERATIONAL":
                return
            self.syncs += 1
            for n in self.valid_tpdos():
                kind = self.get(0x1800 + n, 2)
                if 1 <= kind <= 240 and self.syncs % kind == 0:
                    self.tpdo(n)
            for n, data in self.latched.items():
                self.take(self.fields(0x1600 + n), data)
            self.latched = {}
            if self.get(0x6061) in (8, 9, 10):
                self.follow(self.get(0x60C2, 1) * 10.0 ** self.get(0x60C2, 2))
            self.status()

    def emergency(self, code):
        # Communication, device profile, or of the manufacturer.
        register = 0 if code == 0 else 0x11 if 0x8100 <= code < 0x8300 else 0x21 if 0x8300 <= code < 0x9000 else 0x81
        self.set(0x1001, register)
        self.network.send_message(0x80 + self.id, struct.pack("<HB5x", code, register))

    # The drive.

    def go(self, state):
        if state != self.state:
            print(f"{NAMES[self.state]} -> {NAMES[state]}", flush=True)
        self.state = state
        self.target, self.off_since = None, None
        if state not in (ENABLED, QUICK_STOP, REACTION):
            self.velocity, self.torque = 0.0, 0
        self.status()

    def fault(self, code):
        if self.state not in (REACTION, FAULT):
            self.set(0x603F, code)
            self.emergency(code)
            self.go(REACTION)

    def status(self):
        voltage = 0x10 if self.state not in (NOT_READY, FAULT) else 0
        self.set(0x6041, self.state | 0x200 | voltage | self.bits)
        self.set(0x6064, round(self.position))
        self.set(0x606C, round(self.velocity))
        self.set(0x6077, self.torque)
        if self.nmt == "OPERATIONAL":
            for n in self.valid_tpdos():
                if self.get(0x1800 + n, 2) >= 254:
                    data = b"".join(self.node.get_data(index, sub) for index, sub, _ in self.fields(0x1A00 + n))
                    if data != self.last_sent.get(n):
                        self.tpdo(n)

    def apply_words(self):
        mode = self.get(0x6060)
        if mode in MODES and mode != self.get(0x6061):
            self.set(0x6061, mode)
            self.bits, self.target = 0, None
        word, old = self.get(0x6040), self.control
        self.control = word
        shutdown, switch_on, enable = word & 0x87 == 0x06, word & 0x8F == 0x07, word & 0x8F == 0x0F
        state = self.state
        if state == FAULT:
            if word & ~old & 0x80:
                self.set(0x603F, 0)
                self.emergency(0)
                self.go(DISABLED)
        elif state in (NOT_READY, REACTION):
            pass
        elif word & 0x82 == 0x00:
            if state != DISABLED:
                self.go(DISABLED)
        elif word & 0x86 == 0x02:
            if state == ENABLED:
                self.go(QUICK_STOP)
            elif state in (READY, SWITCHED_ON):
                self.go(DISABLED)
        elif state == DISABLED and shutdown:
            self.go(READY)
        elif state == READY and (switch_on or enable):
            self.go(SWITCHED_ON)
            if enable:
                self.go(ENABLED)
        elif state == SWITCHED_ON and (shutdown or enable):
            self.go(READY if shutdown else ENABLED)
        elif state == ENABLED and (shutdown or switch_on):
            self.go(READY if shutdown else SWITCHED_ON)
        elif state == ENABLED:
            self.begin(word, word & ~old)
        elif state == QUICK_STOP and enable and old & 0x0F != 0x0F:
            self.go(ENABLED)
        self.status()

    def begin(self, word, risen):
        """Set-point and homing handshakes."""
        mode = self.get(0x6061)
        if mode == 1 and risen & 0x10:
            self.target = self.get(0x607A) + (self.position if word & 0x40 else 0)
            self.bits = self.bits & ~0x400 | 0x1000
        elif mode == 1 and not word & 0x10:
            self.bits &= ~0x1000
        elif mode == 6 and risen & 0x10:
            self.bits &= ~0x3400
            self.homed_at = time.monotonic() + 0.05

    def follow(self, dt):
        """One cycle of csp, csv or cst."""
        self.bits &= ~0x3400
        if self.state != ENABLED:
            return
        self.bits |= 0x1000
        before, mode = self.position, self.get(0x6061)
        if mode == 8:
            wanted = self.get(0x607A) + self.get(0x60B0)
            self.position += 0.9 * (wanted - before)
            self.velocity = (self.position - before) / dt
            self.set(0x60F4, wanted - self.position)
            if abs(wanted - before) > self.get(0x6065):
                self.bits |= 0x2000
                self.off_since = self.off_since or time.monotonic()
                if (time.monotonic() - self.off_since) * 1000 >= self.get(0x6066):
                    self.fault(0x8611)
            else:
                self.off_since = None
        elif mode == 9:
            self.velocity = float(self.get(0x60FF) + self.get(0x60B1))
            self.position += self.velocity * dt
        else:
            self.torque = self.get(0x6071) + self.get(0x60B2)
            self.velocity += 1000 * self.torque * dt
            self.position += self.velocity * dt
        inside = self.get(0x607D, 1) <= self.position <= self.get(0x607D, 2)
        self.bits = self.bits & ~0x800 if inside else self.bits | 0x800

    def run(self):
        """What goes by the clock: profile modes, stopping, the heartbeat consumer."""
        last = time.monotonic()
        while True:
            time.sleep(0.01)
            now = time.monotonic()
            dt, last = now - last, now
            with self.lock:
                if self.watched and self.watched[1] and now > self.watched[1]:
                    self.watched[1] = None
                    self.fault(0x8130)
                self.profile(now, dt)

    def ramp(self, to, change, dt):
        step = max(-change, min(change, to - self.velocity))
        self.velocity += step
        self.position += self.velocity * dt

    def profile(self, now, dt):
        mode, halt = self.get(0x6061), self.control & 0x100
        if self.state in (QUICK_STOP, REACTION):
            self.ramp(0.0, self.get(0x6085) * dt, dt)
            if self.velocity == 0:
                if self.state == REACTION:
                    self.go(FAULT)
                elif self.get(0x605A) < 5:
                    self.go(DISABLED)
        elif self.state != ENABLED:
            return
        elif mode == 3:
            to = 0.0 if halt else float(self.get(0x60FF))
            self.ramp(to, self.get(0x6083) * dt, dt)
            self.bits = self.bits | 0x400 if self.velocity == to else self.bits & ~0x400
        elif mode == 1 and self.target is not None:
            way = self.target - self.position
            speed = min(self.get(0x6081), (2 * self.get(0x6084) * abs(way)) ** 0.5, abs(way) / dt)
            self.ramp(0.0 if halt else speed if way > 0 else -speed, self.get(0x6083) * dt, dt)
            if abs(self.target - self.position) < 1:
                self.position, self.velocity, self.target = float(self.target), 0.0, None
                self.bits |= 0x400
        elif mode == 6 and self.homed_at and now > self.homed_at:
            self.homed_at = None
            self.position = float(self.get(0x607C))
            self.bits |= 0x1400
        else:
            return
        self.status()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("interface")
    parser.add_argument("node", type=int)
    parser.add_argument("--heartbeat", type=int, default=0)
    arguments = parser.parse_args()
    Drive(arguments.interface, arguments.node, arguments.heartbeat)
    print("up", flush=True)
    while True:
        time.sleep(1)
