// Imports UANodeSet files in their order, the last of them being ours, and prints what it holds of it as JSON:
// nodeset.mjs FILE...

import { AddressSpace } from "node-opcua-address-space";
import { generateAddressSpace } from "node-opcua-address-space/nodeJS.js";

const space = AddressSpace.create();
await generateAddressSpace(space, process.argv.slice(2));
const index = space.getNamespaceIndex("urn:drivebridge:points");
const named = (id) => space.findNode(`ns=${index};s=${id}`);
const device = named("conveyor/fu1/Device");
const methods = device.getComponentByName("MethodSet").getComponents().map((one) => one.browseName.name);
const range = named("conveyor/fu1/command/frequency").getPropertyByName("EURange").readValue().value.value;
const nodes = [...space.getNamespace(index).nodeIterator()].length;
console.log(
  JSON.stringify({
    nodes,
    type: device.typeDefinitionObj.browseName.name,
    supertype: device.typeDefinitionObj.subtypeOfObj.browseName.name,
    manufacturer: device.getPropertyByName("Manufacturer").readValue().value.value.text,
    below: device.parent.browseName.name,
    methods,
    high: range.high,
    event: named("WatchdogEventType").subtypeOfObj.browseName.name,
  }),
);
space.dispose();
