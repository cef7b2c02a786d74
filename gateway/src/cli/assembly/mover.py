

class Mover:
    """Moves one axis to a target.

    Call `step` with each input. Enable counts from a rising edge on: after a lost connection and after a fault, set it to False and to
    True again. This is not a safety function.
    """

    def __init__(self):
        self.output = AxisOutput()
        self.enable = False
        self.halt = False
        self.reset = False
        self.relative = False
        self.done = False
        self.error = None
        self._phase = 0

    @property
    def busy(self):
        return self._phase > 0

    def move(self, target, velocity, acceleration=0, relative=False):
        """Starts a movement: counts, counts/s, counts/s^2."""
        self.output = self.output._replace(
            {TARGET}=target,
            velocity=velocity,
            {ACCELERATION}
        )
        self.relative, self.done, self.error, self._phase = relative, False, None, 1

    def step(self, shown, connected=True):
        """Takes an AxisInput, and returns the AxisOutput to be sent."""
        status = Status(shown.status if connected else 0)
        if self._phase > 0 and (Status.FAULT in status or self.halt or Status.ENABLED not in status):
            self._end("fault %d" % shown.fault if Status.FAULT in status else "halt" if self.halt else "not in operation")
        elif self._phase == 1 and Status.START_TAKEN not in status:
            self._phase = 2
        elif self._phase == 2 and Status.START_TAKEN in status:
            self._phase = 3
        elif self._phase == 3 and Status.REFUSED in status:
            self._end(REFUSALS.get(shown.refusal, "refusal %d" % shown.refusal))
        elif self._phase == 3 and Status.DONE in status:
            self._phase, self.done = 0, True
        word = Control(0)
        for on, bit in [
            (self.enable, Control.ENABLE),
            (self.halt, Control.STOP),
            (self._phase > 1, Control.START),
            (self.reset, Control.RESET),
            (self.relative, Control.RELATIVE),
        ]:
            if on:
                word |= bit
        {MODE}
        self.output = self.output._replace(control=int(word))
        return self.output

    def _end(self, error):
        self._phase, self.error = 0, error


class Connection:
    """The connection of an owner, with the client `ethernetip` from PyPI."""

    def __init__(self, address, interval_ms=20):
        import ethernetip

        self.client = ethernetip.EtherNetIP(address)
        self.client.startIO(udp_port=0)
        self.link = self.client.explicit_conn(address)
        self.link.registerSession()
        kind = ethernetip.EtherNetIP
        self.inputs = self.client.registerAssembly(kind.ENIP_IO_TYPE_INPUT, INPUT_BYTES, INPUT_POINT, self.link)
        self.outputs = self.client.registerAssembly(kind.ENIP_IO_TYPE_OUTPUT, OUTPUT_BYTES, OUTPUT_POINT, self.link)
        status = self.link.sendFwdOpenReq(
            INPUT_POINT,
            OUTPUT_POINT,
            CONFIGURATION_POINT,
            multiplier=1,
            torpi=interval_ms,
            otrpi=interval_ms,
            inputsz=INPUT_BYTES,
            outputsz=OUTPUT_BYTES,
            originator_udp_port=self.client.originator_udp_port,
        )
        if status != 0:
            self.client.stopIO()
            raise ConnectionError("the device refuses the connection with 0x%04X" % status)
        self.link.produce()

    def send(self, axes):
        data = pack_output(axes)
        for place in range(8 * OUTPUT_BYTES):
            self.outputs[place] = bool(data[place // 8] >> place % 8 & 1)

    def read(self):
        bits = self.inputs
        return unpack_input(bytes(sum(bool(bits[8 * at + bit]) << bit for bit in range(8)) for at in range(INPUT_BYTES)))

    def close(self):
        self.link.stopProduce()
        self.link.sendFwdCloseReq(INPUT_POINT, OUTPUT_POINT, CONFIGURATION_POINT)
        self.client.stopIO()


def main():
    import argparse
    import time

    parser = argparse.ArgumentParser(description="Enables an axis, moves it to a target and takes its torque away.")
    parser.add_argument("address")
    parser.add_argument("--axis", choices=AXES, default=AXES[0])
    parser.add_argument("--to", type=int, required=True, help="target, counts")
    parser.add_argument("--velocity", type=int, required=True, help="counts/s")
    parser.add_argument("--seconds", type=float, default=20.0, help="longest time for each step")
    arguments = parser.parse_args()
    place = AXES.index(arguments.axis)
    connection = Connection(arguments.address)
    mover = Mover()

    def until(what, reached):
        end = time.monotonic() + arguments.seconds
        while time.monotonic() < end:
            shown = connection.read()[place]
            axes = [AxisOutput()] * len(AXES)
            axes[place] = mover.step(shown)
            connection.send(axes)
            if mover.error:
                raise SystemExit("%s: %s" % (arguments.axis, mover.error))
            if reached(shown, Status(shown.status)):
                return shown
            time.sleep(0.004)
        raise SystemExit("%s: not %s within %g s" % (arguments.axis, what, arguments.seconds))

    try:
        until("in run and without ENABLE", lambda _, status: Status.RUN in status and Status.LOCKED not in status)
        mover.enable = True
        until("in operation", lambda _, status: Status.ENABLED in status)
        mover.move(arguments.to, arguments.velocity)
        shown = until("at its target", lambda *_: mover.done)
        print("%s at %d" % (arguments.axis, shown.{ACTUAL}))
        mover.enable = False
        until("without torque", lambda _, status: Status.TORQUE not in status)
    finally:
        connection.close()


if __name__ == "__main__":
    main()
