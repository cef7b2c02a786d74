"""What pycomm3 reads of a device's clock, and the data sheet that it uploads.

Usage: pycomm3_device.py ADDRESS. Prints one JSON object; judged by tests/foreign_clients.rs.
"""

import json
import sys

from explicit import request
from pycomm3 import CIPDriver, Services

TIME_SYNC = 0x43
FILE, EDS = 0x37, 0xC8
INITIATE_UPLOAD, UPLOAD_TRANSFER = 0x4B, 0x4F
LAST, FIRST_AND_LAST = 2, 4
BLOCK = 200


def upload(driver):
    """The data sheet, block by block, with the size that was announced and the sum of its bytes."""
    begun = request(driver, INITIATE_UPLOAD, FILE, EDS, data=bytes([BLOCK])).value
    size = int.from_bytes(begun[:4], "little")
    sheet, number = b"", 0
    while len(sheet) <= size:
        block = request(driver, UPLOAD_TRANSFER, FILE, EDS, data=bytes([number & 0xFF])).value
        if block[1] in (LAST, FIRST_AND_LAST):
            sheet += block[2:-2]
            total = (sum(sheet) + int.from_bytes(block[-2:], "little")) & 0xFFFF
            return {"size": size, "text": sheet.decode("ascii"), "total": total}
        sheet += block[2:]
        number += 1
    return {"size": size, "text": "longer than announced", "total": -1}


def main(address):
    with CIPDriver(address) as driver:
        clock = {}
        for attribute in range(1, 29):
            answer = request(driver, Services.get_attribute_single, TIME_SYNC, 1, attribute)
            clock[attribute] = answer.error or answer.value.hex()
        switched_on = request(driver, Services.set_attribute_single, TIME_SYNC, 1, 1, b"\x01")
        print(json.dumps({"clock": clock, "switched_on": switched_on.error, "sheet": upload(driver)}))


if __name__ == "__main__":
    main(sys.argv[1])
