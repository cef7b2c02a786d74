"""A CANopen node on the package `durand` with an object of any length, 2000:00, for SDO in segments and in blocks.

    canopen_blocks.py INTERFACE NODE

Prints "up", and for each download of 2000:00 its length and CRC-32.
"""

import sys
import time
import zlib

import can
from durand import CANBusNetwork, DatatypeEnum, Node, Variable
from durand.node import NodeCapabilities

interface, number = sys.argv[1], int(sys.argv[2])
network = CANBusNetwork(can.Bus(interface="socketcan", channel=interface))
node = Node(network, node_id=number, capabilities=NodeCapabilities(sdo_servers=1, rpdos=4, tpdos=4))
od = node.object_dictionary
od[0x2000] = Variable(DatatypeEnum.OCTET_STRING, "rw", value=b"at the start", name="Any length")
od[0x2001] = Variable(DatatypeEnum.UNSIGNED32, "rw", value=0x12345678, name="Number")
od.download_callbacks[(0x2000, 0)].add(lambda value: print(len(value), f"{zlib.crc32(value):08X}", flush=True))
print("up", flush=True)
while True:
    time.sleep(1)
