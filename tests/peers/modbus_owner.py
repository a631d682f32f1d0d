"""A PLC: writes control word and setpoint of one unit again and again, over one Modbus TCP connection.

modbus_owner.py PORT UNIT PERIOD_S STAMPS CONTROL_WORD SETPOINT
Appends the wall-clock time from before each write to STAMPS, so that whoever stops this process knows
when it last spoke. Until the drive first runs at its setpoint it acknowledges a trip (a busy machine may
have held it up); after that it never does.
"""

import sys
import time
from pathlib import Path

from pymodbus.client import ModbusTcpClient

TRIPPED = 3

port, unit, period_s, stamps, control_word, setpoint = sys.argv[1:]
wanted = [int(control_word, 0), int(setpoint, 0)]
client = ModbusTcpClient("127.0.0.1", port=int(port), timeout=10)
assert client.connect()


def write(*words: int) -> None:
    answer = client.write_registers(0, list(words), device_id=int(unit))
    assert not answer.isError(), answer


with Path(stamps).open("a", encoding="ascii", buffering=1) as log:
    write(0x047E, 0)
    has_run = False
    while True:
        before = time.time()
        write(*wanted)
        log.write(f"{before:.6f}\n")
        if not has_run:
            inputs = client.read_input_registers(10, count=5, device_id=int(unit)).registers
            if inputs[4] == TRIPPED:
                write(0x04FE, 0)
                write(0x047E, 0)
            data = client.read_input_registers(1, count=1, device_id=int(unit))
            has_run = not data.isError() and data.registers[0] == wanted[1]
            if has_run:
                print("it runs", flush=True)
        time.sleep(float(period_s))
