"""How the ethernetip client consumes the multicast stream of a device with assemblies.

Usage: ethernetip_listener.py ADDRESS LOCAL SECONDS. Opens an input-only connection from LOCAL, writes "open" to standard error, listens
for so long, closes, and prints one JSON object; judged by tests/namespaces/scanner.rs.
"""

import json
import os
import socket
import struct
import sys
import threading
import time
import traceback

import ethernetip
from ethernetip import ethernetip as stack

INPUT, CONFIGURATION, INPUT_ONLY, LISTEN_ONLY = 100, 151, 152, 153
INPUT_LEN = 40
INTERVAL_MS = 20
IP_RECVTTL = 12

# The client reads the socket address items of a reply and forgets them.
READ = []


class Remembered(stack.SocketAddressInfo):
    def unpack(self, buf):
        super().unpack(buf)
        READ.append(self)


stack.SocketAddressInfo = Remembered


def open_as(connection, point, interval=INTERVAL_MS):
    """The client adds 6 to the size of the output: a heartbeat with a run/idle header."""
    return connection.sendFwdOpenReq(
        INPUT, point, CONFIGURATION, multiplier=2, torpi=interval, otrpi=INTERVAL_MS,
        inputsz=INPUT_LEN, outputsz=0, multicast=True)


def main(address, local, seconds):
    result = {}
    client = ethernetip.EtherNetIP(address)
    connection = client.explicit_conn(address)
    connection.registerSession()
    # All of these clients have one vendor and serial number: the connections of a host are told apart by theirs.
    connection.conn_serial_num = 100 * int(local.rsplit(".", 1)[1])
    result["listen_only"] = open_as(connection, LISTEN_ONLY)
    if result["listen_only"] == 0:
        connection.sendFwdCloseReq(INPUT, LISTEN_ONLY, CONFIGURATION)
    result["other_interval"] = open_as(connection, INPUT_ONLY, 2 * INTERVAL_MS)
    if result["other_interval"] == 0:
        connection.sendFwdCloseReq(INPUT, INPUT_ONLY, CONFIGURATION)
    READ.clear()
    result["open"] = open_as(connection, INPUT_ONLY)
    target = [item for item in READ if item.sin_addr]
    group = socket.inet_ntoa(struct.pack("!I", target[-1].sin_addr))
    result["group"], result["port"], result["id"] = group, target[-1].sin_port, connection.toconnid

    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    receiver.setsockopt(socket.IPPROTO_IP, IP_RECVTTL, 1)
    receiver.bind((group, result["port"]))
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(local))
    receiver.settimeout(0.5)

    ends = threading.Event()

    def heartbeats():
        number = 0
        while not ends.is_set():
            number += 1
            packet = ethernetip.UdpSendDataPacket(
                seq_num=number, seq_count=number & 0xFFFF, conn_id=connection.otconnid, len_conn_data=6, data=bytes(4))
            connection.prodsock.sendto(packet.pack(), (address, 2222))
            time.sleep(INTERVAL_MS / 1000)

    thread = threading.Thread(target=heartbeats)
    thread.start()
    print("open", file=sys.stderr, flush=True)
    received = []
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        try:
            datagram, ancillary, _, sender = receiver.recvmsg(2048, 64)
        except TimeoutError:
            continue
        packet = ethernetip.UdpRecvDataPacket(datagram)
        ttl = [struct.unpack("i", data[:4])[0] for level, kind, data in ancillary if level == socket.IPPROTO_IP]
        number = struct.unpack_from("<I", datagram, 10)[0]
        received.append({"from": sender[0], "ttl": ttl, "id": packet.conn_id, "number": number, "bytes": datagram.hex()})
    result["received"] = received
    ends.set()
    thread.join()
    result["close"] = connection.sendFwdCloseReq(INPUT, INPUT_ONLY, CONFIGURATION)
    # Nothing comes for a stream that nobody consumes; another one's goes on.
    time.sleep(0.3)
    receiver.setblocking(False)
    try:
        while True:
            receiver.recv(2048)
    except BlockingIOError:
        pass
    receiver.settimeout(0.5)
    try:
        receiver.recv(2048)
        result["goes_on"] = True
    except TimeoutError:
        result["goes_on"] = False
    print(json.dumps(result), flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except BaseException:
        # The threads of the client would keep the process.
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)
