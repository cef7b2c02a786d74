"""How the ethernetip client moves the second axis of a device with the layout "position", with pauses for its judge.

Usage: ethernetip_scanner.py ADDRESS. At each step it writes a line to standard error and waits for one on standard input, while its
data go on; judged by tests/namespaces/scanner.rs.
"""

import os
import struct
import sys
import threading
import time
import traceback

import ethernetip

OUTPUT, INPUT, CONFIGURATION = 150, 100, 151
AXES = 2
OUTPUT_LEN, INPUT_LEN = 16, 20
INTERVAL_MS = 20
ENABLE, START, RESET = 1, 4, 8
ENABLED, FAULT, DONE, LOCKED, STANDSTILL, TORQUE = 1 << 1, 1 << 2, 1 << 4, 1 << 7, 1 << 10, 1 << 14
COUNTS = 10_000


class Scanner:
    """The client's connection with a run/idle header that can be idle, which its own producer cannot."""

    def __init__(self, client, address):
        self.client = client
        self.address = address
        self.connection = client.explicit_conn(address)
        self.connection.registerSession()
        kinds = ethernetip.EtherNetIP
        self.inputs = client.registerAssembly(kinds.ENIP_IO_TYPE_INPUT, AXES * INPUT_LEN, INPUT, self.connection)
        self.outputs = client.registerAssembly(kinds.ENIP_IO_TYPE_OUTPUT, AXES * OUTPUT_LEN, OUTPUT, self.connection)
        self.run = True
        self.ends = False

    def open(self):
        return self.connection.sendFwdOpenReq(
            INPUT, OUTPUT, CONFIGURATION, multiplier=2, torpi=INTERVAL_MS, otrpi=INTERVAL_MS,
            inputsz=AXES * INPUT_LEN, outputsz=AXES * OUTPUT_LEN)

    def produce(self):
        self.thread = threading.Thread(target=self._produce)
        self.thread.start()

    def _produce(self):
        number = 0
        while not self.ends:
            number += 1
            bits = self.outputs
            data = bytes(sum(bool(bits[8 * at + bit]) << bit for bit in range(8)) for at in range(AXES * OUTPUT_LEN))
            data = struct.pack("<I", int(self.run)) + data
            packet = ethernetip.UdpSendDataPacket(
                seq_num=number, seq_count=number & 0xFFFF, conn_id=self.connection.otconnid,
                len_conn_data=len(data) + 2, data=data)
            self.connection.prodsock.sendto(packet.pack(), (self.address, 2222))
            time.sleep(self.connection.otapi / 1000)

    def send(self, word, target=0, velocity=0):
        data = bytes(OUTPUT_LEN) + struct.pack("<HHiii", word, 0, target, velocity, 0)
        for place in range(8 * len(data)):
            self.outputs[place] = bool(data[place // 8] >> place % 8 & 1)

    def status(self):
        word = [self.inputs[8 * INPUT_LEN + bit] for bit in range(16)]
        return sum(bool(on) << bit for bit, on in enumerate(word))

    def until(self, what, wanted=0, unwanted=0):
        end = time.monotonic() + 20
        while time.monotonic() < end:
            status = self.status()
            if status & wanted == wanted and not status & unwanted:
                return
            time.sleep(0.004)
        raise TimeoutError(f"{what} is not reached: {self.status():#x}")


def step(text):
    print(text, file=sys.stderr, flush=True)
    sys.stdin.readline()


def main(address):
    client = ethernetip.EtherNetIP(address)
    client.startIO()
    plc = Scanner(client, address)
    plc.send(0)
    if plc.open() != 0:
        raise RuntimeError("the connection is refused")
    plc.produce()
    plc.until("armed", unwanted=LOCKED | FAULT)
    # What came before the first data was nothing.
    time.sleep(0.2)
    plc.send(ENABLE)
    plc.until("in operation", wanted=ENABLED)
    step("enabled")
    plc.send(ENABLE | START, 125_000, 50 * COUNTS)
    plc.until("12.5 mm", wanted=DONE | STANDSTILL)
    time.sleep(0.2)
    step("moved 12.5")
    plc.send(ENABLE)
    time.sleep(0.1)
    plc.send(ENABLE | START, 700 * COUNTS, 50 * COUNTS)
    time.sleep(0.5)
    plc.run = False
    time.sleep(0.5)
    plc.until("the end of an idle movement", wanted=FAULT, unwanted=TORQUE)
    step("idle")
    plc.send(0)
    plc.run = True
    time.sleep(0.2)
    plc.send(RESET)
    plc.until("without a fault", unwanted=FAULT | LOCKED)
    plc.send(0)
    time.sleep(0.1)
    plc.send(ENABLE)
    plc.until("in operation", wanted=ENABLED)
    plc.send(ENABLE | START, 25_000, 50 * COUNTS)
    plc.until("2.5 mm", wanted=DONE | STANDSTILL)
    time.sleep(0.2)
    step("moved 2.5")
    plc.send(0)
    plc.until("without torque", unwanted=TORQUE)
    step("disabled")
    plc.ends = True
    plc.thread.join()
    if plc.connection.sendFwdCloseReq(INPUT, OUTPUT, CONFIGURATION) != 0:
        raise RuntimeError("the close is refused")
    client.stopIO()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except BaseException:
        # The threads of the client would keep the process.
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)
