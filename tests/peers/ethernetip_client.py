"""What the ethernetip client gets from a box: List*, explicit messages, the motion connection, its close.

Usage: ethernetip_client.py ADDRESS. Prints one JSON object; judged by tests/foreign_clients.rs.
"""

import json
import select
import socket
import sys
import time

import ethernetip

MOTION_AXIS = 0x42
CONFIGURATION_POINT = 0x51
FORMAT_REVISION = 2
UPDATE_PERIOD_MS = 8
# C-to-D header of an initial update: variable format, revision, update ID, node control off, one instance.
INITIAL = bytes.fromhex("0602010000000000")


def path():
    """20 42 2C 51 2C 02: the class, the configuration point, the I/O point."""
    points = ethernetip.ConnectionPath()
    points.addLogicalSegment(cls=MOTION_AXIS)
    points.addLogicalSegment(connection_point=CONFIGURATION_POINT)
    points.addLogicalSegment(connection_point=FORMAT_REVISION)
    return points


def open_motion(connection, port, configuration=bytes([1, 0, 0, 0, 0, 0, 0, 0]), size=200):
    """Forward_Open of the motion connection, its answers to `port`. The client adds 6 and 2 to the sizes."""
    return connection.sendFwdOpenReq(
        None,
        None,
        None,
        connection_path=path(),
        multiplier=2,
        torpi=UPDATE_PERIOD_MS,
        otrpi=UPDATE_PERIOD_MS,
        inputsz=size,
        outputsz=size,
        configData=configuration,
        fixed_connection_size=False,
        priority=ethernetip.ForwardOpenReq.FORWARD_OPEN_CONN_PRIO_URGENT,
        originator_udp_port=port,
    )


def close_motion(connection, serial=None):
    """Forward_Close; the general status that came back."""
    connection.sock.settimeout(5)
    request = ethernetip.ForwardCloseReq(
        conn_serial=connection.conn_serial_num if serial is None else serial,
        mkpath=connection.mkReqPath(0x06, 1, None),
        plen=len(path().get()) // 2,
        data=path().get(),
    )
    return connection.unconnSend(0x4E, bytes(request))


def main(address):
    result = {}
    client = ethernetip.EtherNetIP(address)
    first = client.explicit_conn(address)
    identity = first.listID()
    result["list_identity"] = {
        "vendor": identity.vendor_id,
        "device_type": identity.device_type,
        "product_code": identity.product_code,
        "product_name": identity.product_name.decode(),
    }
    services = first.listServices()
    result["list_services"] = {"capability": services.capability_flags, "name": services.name_of_service.rstrip(b"\0").decode()}
    result["register"] = first.registerSession()
    status, value = first.getAttrSingle(0x01, 1, 7)
    result["product_name"] = {"status": status, "value": value.hex()}
    status, value = first.getAttrSingle(MOTION_AXIS, 1, 40)
    result["control_mode"] = {"status": status, "value": value.hex()}
    status, value = first.getAttrSingle(MOTION_AXIS, 1, 650)
    result["unpadded_path"] = {"status": status, "value": value.hex()}
    status, value = first.getAttrSingle(0x99, 1, 1)
    result["missing_class"] = {"status": status, "value": value.hex()}

    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("", 0))
    port = receiver.getsockname()[1]
    result["wrong_configuration"] = open_motion(first, port, configuration=bytes(4))
    result["too_small"] = open_motion(first, port, size=2)
    result["open"] = open_motion(first, port)
    result["intervals_ms"] = [first.otapi, first.toapi]
    second = client.explicit_conn(address)
    second.registerSession()
    result["second_owner"] = open_motion(second, port)

    received = []
    for sequence in range(1, 6):
        packet = ethernetip.UdpSendDataPacket(
            seq_num=sequence,
            seq_count=sequence,
            conn_id=first.otconnid,
            len_conn_data=len(INITIAL) + 2,
            data=INITIAL,
        )
        receiver.sendto(packet.pack(), (address, 2222))
        end = time.monotonic() + UPDATE_PERIOD_MS / 1000
        while (left := end - time.monotonic()) > 0:
            readable, _, _ = select.select([receiver], [], [], left)
            if readable:
                datagram, sender = receiver.recvfrom(2048)
                item = ethernetip.UdpRecvDataPacket(datagram)
                received.append({"from": sender[0], "mine": item.conn_id == first.toconnid, "data": bytes(item.data).hex()})
    result["received"] = received
    result["close"] = close_motion(first)[0]
    answer = close_motion(first)
    result["close_again"] = {"status": answer[0], "value": bytes(answer[1]).hex()}
    result["second_opens_after_close"] = open_motion(second, port)
    result["second_closes"] = close_motion(second)[0]
    first.unregisterSession()
    second.unregisterSession()
    receiver.close()
    print(json.dumps(result))


if __name__ == "__main__":
    main(sys.argv[1])
