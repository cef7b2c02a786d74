"""CAN adapters on serial lines, as the driver `slcan` of Linux knows them, on one bus.

    slcan_adapter.py COUNT CONTROL

Each of COUNT adapters is the far end of a pseudo terminal whose near end is given to the driver, which makes an interface of
it: can0, can1 and so on. What one sends the others hear, as long as they are open and at the same bit rate. Prints "up", and
every command but frames: "0 S6", "0 O", "0 C". What is written into the FIFO CONTROL, "0 sb256000", adapter 0 says to its host;
after bus off ("sb") it is on the bus again when it is opened anew.

Needs CAP_NET_ADMIN, and nothing but Python's own library.
"""

import fcntl
import os
import pty
import select
import struct
import sys
import termios
import tty

N_SLCAN = 17


class Adapter:
    def __init__(self, number):
        self.number, self.rate, self.on_bus, self.rest = number, None, False, b""
        self.line, near = pty.openpty()
        tty.setraw(near)
        fcntl.ioctl(near, termios.TIOCSETD, struct.pack("i", N_SLCAN))
        # The driver has it as long as it is open.
        self.near = near

    def say(self, line):
        if line.startswith(b"sb"):
            self.on_bus = False
        os.write(self.line, line + b"\r")

    def commands(self):
        *lines, self.rest = (self.rest + os.read(self.line, 65536)).split(b"\r")
        return lines

    def obey(self, command, others):
        if command[:1] in b"tTrR":
            for other in others:
                if self.on_bus and other.on_bus and other.rate == self.rate:
                    other.say(command)
            return
        if command[:1] == b"S":
            self.rate = command
        self.on_bus = command == b"O"
        print(self.number, command.decode(), flush=True)


count, control = int(sys.argv[1]), sys.argv[2]
adapters = [Adapter(number) for number in range(count)]
os.mkfifo(control)
told = os.open(control, os.O_RDWR)
print("up", flush=True)
while True:
    ready, _, _ = select.select([told] + [adapter.line for adapter in adapters], [], [])
    for adapter in adapters:
        if adapter.line in ready:
            for command in filter(None, adapter.commands()):
                adapter.obey(command, [other for other in adapters if other is not adapter])
    if told in ready:
        for line in os.read(told, 4096).split(b"\n"):
            if line:
                number, text = line.split(b" ", 1)
                adapters[int(number)].say(text)
