"""A Modbus server that shares no code with ours: pymodbus with the register map of a LabJack T.

pymodbus_server.py tcp            serves on a free port of 127.0.0.1
pymodbus_server.py rtu /dev/...   serves unit 1 on that serial port, 115200 baud, no parity (a pty has none)

Prints one line when it is ready: the port. AIN#n (float32 at 2n) reads n + 0.25 V, register 100 reads 1234, 101
reads -1234 as int16; the core timer (61520) counts the questions for it in steps of 40 million from just below
its wrap.
"""

import asyncio
import struct
import sys

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.server.async_io import ModbusSerialServer, ModbusTcpServer

TIMER = 61520


def pair(kind, value):
    return list(struct.unpack(">HH", struct.pack(kind, value)))


class Registers(ModbusSparseDataBlock):
    def __init__(self):
        values = {55100: 0x0011, 55101: 0x2233, 100: 1234, 101: 0x10000 - 1234, TIMER: 0, TIMER + 1: 0}
        for n in range(14):
            values[2 * n], values[2 * n + 1] = pair(">f", n + 0.25)
        super().__init__(values)
        self.timer = 0xFFFFFFFF - 60_000_000

    def getValues(self, address, count=1):
        if address == TIMER:
            self.timer = (self.timer + 40_000_000) % 2**32
            return pair(">I", self.timer)
        return super().getValues(address, count)


async def main():
    registers = Registers()
    unit = ModbusSlaveContext(hr=registers, ir=registers, zero_mode=True)
    context = ModbusServerContext(slaves=unit, single=True)
    if sys.argv[1] == "tcp":
        server = ModbusTcpServer(context, address=("127.0.0.1", 0))
        task = asyncio.create_task(server.serve_forever())
        while server.server is None:
            await asyncio.sleep(0.01)
        print(server.server.sockets[0].getsockname()[1], flush=True)
    else:
        server = ModbusSerialServer(
            context, framer=ModbusRtuFramer, port=sys.argv[2], baudrate=115200, parity="N", stopbits=1
        )
        await server.start()
        print(sys.argv[2], flush=True)
        task = asyncio.create_task(server.serve_forever())
    await task


asyncio.run(main())
