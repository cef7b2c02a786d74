"""How the ethernetip client, with its own class 1 stack, moves an axis through assemblies.

Usage: ethernetip_assembly.py ADDRESS MOTION_ADDRESS. The first is a device with one axis and the layout "position", the second a
CIP Motion device of the same gateway. Prints one JSON object; judged by tests/foreign_clients.rs.
"""

import json
import os
import struct
import sys
import time
import traceback

import ethernetip

OUTPUT, INPUT, CONFIGURATION, INPUT_ONLY = 150, 100, 151, 152
OUTPUT_LEN, INPUT_LEN = 16, 20
INTERVAL_MS = 20
ENABLE, STOP, START, RESET = 1, 2, 4, 8
ENABLED, FAULT, DONE, LOCKED, STANDSTILL, TORQUE = 1 << 1, 1 << 2, 1 << 4, 1 << 7, 1 << 10, 1 << 14


class Plc:
    """A controller with the client's threads: one sends its bits, one writes what came."""

    def __init__(self, client, address):
        self.client = client
        self.connection = client.explicit_conn(address)
        self.connection.registerSession()
        self.inputs = client.registerAssembly(ethernetip.EtherNetIP.ENIP_IO_TYPE_INPUT, INPUT_LEN, INPUT, self.connection)
        self.outputs = client.registerAssembly(ethernetip.EtherNetIP.ENIP_IO_TYPE_OUTPUT, OUTPUT_LEN, OUTPUT, self.connection)

    def open(self, consumed=OUTPUT, produced=INPUT, inputsz=INPUT_LEN, outputsz=OUTPUT_LEN, multicast=False):
        return self.connection.sendFwdOpenReq(
            produced,
            consumed,
            CONFIGURATION,
            multiplier=1,
            torpi=INTERVAL_MS,
            otrpi=INTERVAL_MS,
            inputsz=inputsz,
            outputsz=outputsz,
            multicast=multicast,
            originator_udp_port=self.client.originator_udp_port,
        )

    def close(self):
        return self.connection.sendFwdCloseReq(INPUT, OUTPUT, CONFIGURATION)

    def send(self, word, target=0, velocity=0, acceleration=0):
        data = struct.pack("<HHiii", word, 0, target, velocity, acceleration)
        for place in range(8 * OUTPUT_LEN):
            self.outputs[place] = bool(data[place // 8] >> place % 8 & 1)

    def read(self):
        data = bytes(sum(bool(self.inputs[8 * at + bit]) << bit for bit in range(8)) for at in range(INPUT_LEN))
        status, mode, refusal, fault, torque, position, velocity, error = struct.unpack("<HBBHhiii", data)
        return {"status": status, "mode": mode, "refusal": refusal, "fault": fault, "position": position, "velocity": velocity}

    def until(self, what, wanted=0, unwanted=0):
        end = time.monotonic() + 20
        while time.monotonic() < end:
            shown = self.read()
            if shown["status"] & wanted == wanted and not shown["status"] & unwanted:
                return shown
            time.sleep(0.004)
        raise TimeoutError(f"{what} is not reached: {self.read()}")


def main(address, motion_address):
    result = {}
    client = ethernetip.EtherNetIP(address)
    client.startIO(udp_port=0)
    plc = Plc(client, address)
    result["device_type"] = plc.connection.listID().device_type
    result["motion_device_type"] = client.explicit_conn(motion_address).listID().device_type
    motion = Plc(ethernetip.EtherNetIP(motion_address), motion_address)
    result["at_the_motion_device"] = motion.open()
    result["long"] = plc.open(outputsz=OUTPUT_LEN + 1)
    result["short"] = plc.open(inputsz=INPUT_LEN - 1)
    result["no_such_output"] = plc.open(consumed=OUTPUT - 1)
    result["no_such_input"] = plc.open(produced=INPUT + 1)
    result["multicast"] = [plc.open(multicast=True), plc.close()]

    # ENABLE is 1 from the start: it does not count.
    plc.send(ENABLE | START, 125_000, 500_000)
    result["open"] = plc.open()
    plc.connection.produce()
    time.sleep(0.5)
    result["at_first"] = plc.until("locked", wanted=LOCKED)
    second = Plc(ethernetip.EtherNetIP(address), address)
    result["second_owner"] = second.open()

    plc.send(0)
    plc.until("armed", unwanted=LOCKED)
    # A host in a hurry may have lost its bus before.
    plc.send(RESET)
    plc.until("without a fault", unwanted=FAULT)
    plc.send(ENABLE)
    plc.until("in operation", wanted=ENABLED)
    plc.send(ENABLE | START, 125_000, 500_000)
    result["arrived"] = plc.until("the target", wanted=DONE | STANDSTILL)
    plc.send(ENABLE)
    time.sleep(0.1)
    plc.send(ENABLE | START, 7_000_000, 500_000)
    time.sleep(0.5)
    result["under_way"] = plc.read()

    # The controller falls silent; what it opens then is another connection.
    plc.connection.stopProduce()
    time.sleep(1.5)
    plc.send(ENABLE | START | RESET, 125_000, 500_000)
    result["open_again"] = plc.open()
    plc.connection.seqnum = 0
    plc.connection.produce()
    time.sleep(0.5)
    result["again"] = plc.until("locked", wanted=LOCKED | FAULT | STANDSTILL)
    time.sleep(0.5)
    result["still"] = plc.read()
    plc.send(0)
    time.sleep(0.2)
    plc.send(RESET)
    plc.until("without a fault", unwanted=FAULT)
    plc.send(0)
    time.sleep(0.1)
    plc.send(ENABLE)
    plc.until("in operation", wanted=ENABLED)
    plc.send(ENABLE | START, 0, 1_000_000)
    result["home"] = plc.until("the start", wanted=DONE | STANDSTILL)
    plc.send(0)
    result["off"] = plc.until("without torque", unwanted=TORQUE)
    plc.connection.stopProduce()
    result["close"] = plc.close()
    client.stopIO()
    print(json.dumps(result))


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except BaseException:
        # The threads of the client would keep the process.
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
