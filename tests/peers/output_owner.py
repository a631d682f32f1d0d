"""A PLC: writes the first output of one unit again and again, over one Modbus TCP connection.

output_owner.py PORT UNIT PERIOD_S VALUE
Until the output is active it writes the safe value in between, and acknowledges a trip (a busy machine may
have held it up); after that it never does.
"""

import sys
import time

from pymodbus.client import ModbusTcpClient

TRIPPED, OUTPUT, STATE, ACKNOWLEDGE = 3, 32, 14, 11

port, unit, period_s, value = sys.argv[1:]
client = ModbusTcpClient("127.0.0.1", port=int(port), timeout=10)
assert client.connect()


def write(register: int, word: int) -> None:
    answer = client.write_register(register, word, device_id=int(unit))
    assert not answer.isError(), answer


write(OUTPUT, 0)
is_active = False
while True:
    write(OUTPUT, int(value, 0))
    if not is_active:
        state = client.read_input_registers(STATE, count=1, device_id=int(unit)).registers[0]
        sent = client.read_holding_registers(OUTPUT, count=1, device_id=int(unit))
        if state == TRIPPED:
            write(ACKNOWLEDGE, 1)
            write(ACKNOWLEDGE, 0)
        is_active = not sent.isError() and sent.registers[0] == int(value, 0)
        if is_active:
            print("active", flush=True)
        else:
            write(OUTPUT, 0)
    time.sleep(float(period_s))
