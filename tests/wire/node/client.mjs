// Plays node-opcua against the server and prints what it saw as one line of JSON.
// node client.mjs URL [USER PASSWORD]: with a user on the encrypted endpoint, else on the open one.
import {
  AttributeIds, DataType, MessageSecurityMode, OPCUAClient, SecurityPolicy, TimestampsToReturn,
  UserTokenType, Variant,
} from "node-opcua-client";

const [url, user, password] = process.argv.slice(2);
const client = OPCUAClient.create({
  endpointMustExist: false,
  connectionStrategy: { maxRetry: 0 },
  securityMode: user ? MessageSecurityMode.SignAndEncrypt : MessageSecurityMode.None,
  securityPolicy: user ? SecurityPolicy.Basic256Sha256 : SecurityPolicy.None,
});
await client.connect(url);
const session = await client.createSession(
  user ? { type: UserTokenType.UserName, userName: user, password } : undefined);
const namespaces = await session.readNamespaceArray();
const id = (name) => `ns=${namespaces.indexOf("urn:drivebridge:points")};s=${name}`;
const seen = {};

const folder = await session.browse(id("conveyor/fu1"));
seen.children = folder.references.map((reference) => reference.browseName.name);
const unit = await session.read({ nodeId: id("conveyor/fu1/actual/frequency/EngineeringUnits") });
seen.unit = unit.value.value.displayName.text;

const write = (name, dataType, value) => session.write({
  nodeId: id(name), attributeId: AttributeIds.Value, value: { value: new Variant({ dataType, value }) },
});
const told = [];
const subscription = await session.createSubscription2({
  requestedPublishingInterval: 50, requestedLifetimeCount: 100, requestedMaxKeepAliveCount: 10,
  publishingEnabled: true,
});
const item = await subscription.monitor(
  { nodeId: id("conveyor/fu1/status/state"), attributeId: AttributeIds.Value },
  { samplingInterval: 50, queueSize: 10, discardOldest: true }, TimestampsToReturn.Both);
item.on("changed", (value) => told.push(value.value.value));

const state = async (wanted) => {
  for (let wait = 0; told.at(-1) !== wanted && wait < 100; wait += 1) {
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
};
seen.ready = (await write("conveyor/fu1/command/control_word", DataType.Int32, 0x047e)).name;
await state(2);
seen.run = (await write("conveyor/fu1/command/control_word", DataType.UInt16, 0x047f)).name;
await state(4);
seen.readOnly = (await write("conveyor/fu1/status/status_word", DataType.UInt16, 1)).name;
seen.wrongType = (await write("conveyor/fu1/command/control_word", DataType.String, "run")).name;
seen.notOurs = (await write("conveyor/fu2/command/control_word", DataType.UInt16, 0x047f)).name;
const stopped = await session.call({
  objectId: id("conveyor/fu1"), methodId: id("conveyor/fu1/Stop"), inputArguments: [],
});
seen.stop = stopped.statusCode.name;
await state(2);
seen.states = told;

await subscription.terminate();
await session.close();
await client.disconnect();
console.log(JSON.stringify(seen));
