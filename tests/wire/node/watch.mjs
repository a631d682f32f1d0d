// Watches many values and counts what it is told of them, in one line of JSON for each line that it reads.
// node watch.mjs URL NAMESPACE PREFIX FIRST COUNT INTERVAL_MS; NAMESPACE is a URI or an index.
import readline from "node:readline";
import { AttributeIds, OPCUAClient, TimestampsToReturn } from "node-opcua-client";

const [url, namespace, prefix, first, count, intervalMs] = process.argv.slice(2);
const client = OPCUAClient.create({ endpointMustExist: false, connectionStrategy: { maxRetry: 0 } });
await client.connect(url);
const session = await client.createSession();
const index = namespace.includes(":") ? (await session.readNamespaceArray()).indexOf(namespace) : Number(namespace);
const subscription = await session.createSubscription2({
  requestedPublishingInterval: Number(intervalMs), requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 10,
  publishingEnabled: true, maxNotificationsPerPublish: 0,
});
const wanted = Array.from({ length: Number(count) }, (_, n) => ({
  nodeId: `ns=${index};s=${prefix}${Number(first) + n}`, attributeId: AttributeIds.Value,
}));
const group = await subscription.monitorItems(
  wanted, { samplingInterval: Number(intervalMs), queueSize: 2, discardOldest: true }, TimestampsToReturn.Both);
let changes = 0;
group.on("changed", () => { changes += 1; });
console.log(JSON.stringify({ watching: wanted.length }));
for await (const _ of readline.createInterface({ input: process.stdin })) console.log(JSON.stringify({ changes }));
await session.close();
await client.disconnect();
