// Plays node-opcua through lost connections: prints each value and each repair as a line of JSON, until
// its standard input ends.
// node reconnect.mjs URL USER PASSWORD
import {
  AttributeIds, MessageSecurityMode, OPCUAClient, SecurityPolicy, TimestampsToReturn, UserTokenType,
} from "node-opcua-client";

const [url, user, password] = process.argv.slice(2);
const say = (what) => process.stdout.write(`${JSON.stringify(what)}\n`);
const client = OPCUAClient.create({
  endpointMustExist: false,
  connectionStrategy: { initialDelay: 100, maxDelay: 300, maxRetry: 100 },
  securityMode: MessageSecurityMode.SignAndEncrypt,
  securityPolicy: SecurityPolicy.Basic256Sha256,
  keepSessionAlive: false,
});
const sent = {};
client.on("send_request", (request) => {
  const name = request.constructor.name;
  sent[name] = (sent[name] ?? 0) + 1;
});
await client.connect(url);
const session = await client.createSession({ type: UserTokenType.UserName, userName: user, password });
session.on("session_repaired", () => say({ repaired: session.sessionId.toString() }));
const namespaces = await session.readNamespaceArray();
const space = namespaces.indexOf("urn:drivebridge:points");
const subscription = await session.createSubscription2({
  requestedPublishingInterval: 50, requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 10,
  publishingEnabled: true,
});
const item = await subscription.monitor(
  { nodeId: `ns=${space};s=bus/can0/load`, attributeId: AttributeIds.Value },
  { samplingInterval: 0, queueSize: 10, discardOldest: true }, TimestampsToReturn.Both);
item.on("changed", (value) => say({ value: value.value.value, subscription: subscription.subscriptionId }));

process.stdin.resume();
await new Promise((resolve) => process.stdin.on("end", resolve));
await session.close();
await client.disconnect();
say({ sent });
