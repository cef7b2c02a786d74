"""CANopen nodes without a node-id on the package `durand`, for LSS.

    canopen_lss.py INTERFACE SERIAL[:MS]...

Each has its serial number and answers so many milliseconds late. Prints "up", and what each is told to store.
"""

import sys
import time

import can
from durand import CANBusNetwork, MinimalNode

VENDOR, PRODUCT, REVISION = 0x7FFFFFF1, 0x0400D00D, 0x80000001


class Late(CANBusNetwork):
    def __init__(self, bus, late):
        self.late = late
        super().__init__(bus)

    def send(self, cob_id, msg):
        time.sleep(self.late)
        super().send(cob_id, msg)


def device(serial, late):
    network = Late(can.Bus(interface="socketcan", channel=sys.argv[1]), late / 1000)
    node = MinimalNode(network, node_id=0xFF)
    for sub, number in enumerate((VENDOR, PRODUCT, REVISION, serial), 1):
        node.object_dictionary.write(0x1018, sub, number)
    node.lss.set_baudrate_change_callback(lambda rate, delay: None)
    node.lss.set_store_configuration_callback(lambda rate, number: print(f"{serial:X} stores {number} {rate}", flush=True))
    return node


nodes = [device(int(serial, 16), int(late or 0)) for serial, _, late in (word.partition(":") for word in sys.argv[2:])]
print("up", flush=True)
while True:
    time.sleep(1)
