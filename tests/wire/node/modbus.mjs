// Reads runs of registers and bits with modbus-serial, a client that is not ours.
//
// node modbus.mjs PORT < RUNS: RUNS is a JSON list of [unit, function, start, count]; printed is a JSON list with the
// values of each, or the message of its error.

import { readFileSync } from "node:fs";

import ModbusRTU from "modbus-serial";

const READS = {
  1: "readCoils",
  2: "readDiscreteInputs",
  3: "readHoldingRegisters",
  4: "readInputRegisters",
};

const client = new ModbusRTU();
await client.connectTCP("127.0.0.1", { port: Number(process.argv[2]) });
client.setTimeout(5000);
const found = [];
for (const [unit, code, start, count] of JSON.parse(readFileSync(0, "utf8"))) {
  client.setID(unit);
  try {
    found.push((await client[READS[code]](start, count)).data);
  } catch (error) {
    found.push(error.message);
  }
}
console.log(JSON.stringify(found));
client.close(() => {});
