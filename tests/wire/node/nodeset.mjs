// Imports UANodeSet files in their order, the last of them being ours, and prints what it holds of it as JSON:
// nodeset.mjs FILE...

import { AddressSpace } from "node-opcua-address-space";
import { generateAddressSpace } from "node-opcua-address-space/nodeJS.js";

const space = AddressSpace.create();
await generateAddressSpace(space, process.argv.slice(2));
const index = space.getNamespaceIndex("urn:drivebridge:points");
const named = (id) => space.findNode(`ns=${index};s=${id}`);
const asset = named("conveyor/fu1/Asset");
const methods = asset.getComponentByName("MethodSet").getComponents().map((one) => one.browseName.name);
const range = named("conveyor/fu1/command/frequency").getPropertyByName("EURange").readValue().value.value;
const nodes = [...space.getNamespace(index).nodeIterator()].length;
console.log(
  JSON.stringify({
    nodes,
    type: asset.typeDefinitionObj.browseName.name,
    supertype: asset.typeDefinitionObj.subtypeOfObj.browseName.name,
    manufacturer: asset.getPropertyByName("Manufacturer").readValue().value.value.text,
    below: asset.parent.browseName.name,
    methods,
    high: range.high,
    event: named("WatchdogEventType").subtypeOfObj.browseName.name,
  }),
);
space.dispose();
