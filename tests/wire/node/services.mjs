// Asks node-opcua's way for what each service answers, and prints it as one line of JSON.
// node services.mjs URL
import {
  AttributeIds, DataChangeFilter, HistoryReadRequest, ReadAtTimeDetails, ReadEventDetails, DataChangeTrigger, DeadbandType, MessageSecurityMode, MonitoringMode,
  OPCUAClient, SecurityPolicy, TimestampsToReturn, constructEventFilter, ofType,
} from "node-opcua-client";

const [url] = process.argv.slice(2);
const client = OPCUAClient.create({
  endpointMustExist: false, connectionStrategy: { maxRetry: 0 },
  securityMode: MessageSecurityMode.None, securityPolicy: SecurityPolicy.None,
});
await client.connect(url);
const session = await client.createSession();
const namespaces = await session.readNamespaceArray();
const id = (name) => `ns=${namespaces.indexOf("urn:drivebridge:points")};s=${name}`;
const seen = {};
const failed = async (promise) => {
  try { await promise; return "Good"; } catch (error) { return /Bad\w+/.exec(error.message)?.[0] ?? error.message; }
};

session.requestedMaxReferencesPerNode = 3;
let result = await session.browse(id("conveyor/fu1"));
seen.browsed = [result.references.length];
while (result.continuationPoint) {
  result = await session.browseNext(result.continuationPoint, false);
  seen.browsed.push(result.references.length);
}
const [none_kept] = await session.readHistoryValue([id("bus/can0/load")], new Date(0), new Date());
seen.history = none_kept.statusCode.name;
const frequency = id("conveyor/fu1/actual/frequency");
const [kept] = await session.readHistoryValue([frequency], new Date(0), new Date(), {
  numValuesPerNode: 5, returnBounds: false,
});
seen.kept = [kept.statusCode.name, kept.historyData.dataValues.length > 0];
const last = kept.historyData.dataValues.at(-1);
// A Date has milliseconds only.
const reqTimes = [new Date(last.sourceTimestamp.getTime() + 1)];
const at = await session.historyRead(new HistoryReadRequest({
  historyReadDetails: new ReadAtTimeDetails({ reqTimes, useSimpleBounds: true }),
  nodesToRead: [{ nodeId: frequency }], timestampsToReturn: TimestampsToReturn.Both,
}));
seen.at = at.results[0].historyData.dataValues[0].value.value === last.value.value;
const fields = constructEventFilter(["SourceName", "Message", "Severity"]);
const past = await session.historyRead(new HistoryReadRequest({
  historyReadDetails: new ReadEventDetails({
    startTime: new Date(0), endTime: new Date(Date.now() + 60000), numValuesPerNode: 10, filter: fields,
  }),
  nodesToRead: [{ nodeId: "i=2253" }], timestampsToReturn: TimestampsToReturn.Both,
}));
seen.past = past.results[0].historyData.events.map((one) => one.eventFields.map(({ value }) => value.text ?? value));
seen.query = await failed(session.queryFirst({}));
const part = await session.read({ nodeId: "i=2255", attributeId: AttributeIds.Value, indexRange: "1:2" });
seen.part = part.value.value.length;
const none = await session.read({ nodeId: "i=2267", attributeId: AttributeIds.Value, indexRange: "1" });
seen.none = none.statusCode.name;

// The sessions' own objects come behind the two arrays.
const sessions = (await session.browse("i=3706")).references;
seen.sessions = sessions.length;
const own = sessions.at(-1).nodeId.toString();
const security = await session.read({ nodeId: `${own}/SessionSecurityDiagnostics`, attributeId: AttributeIds.Value });
const { encoding, transportProtocol, securityPolicyUri, clientUserIdHistory } = security.value.value;
seen.security = [encoding, transportProtocol, securityPolicyUri, clientUserIdHistory];
const counted = await session.read({ nodeId: `${own}/SessionDiagnostics`, attributeId: AttributeIds.Value });
seen.queries = [counted.value.value.queryFirstCount.totalCount, counted.value.value.queryFirstCount.errorCount];

const subscription = await session.createSubscription2({
  requestedPublishingInterval: 1, requestedLifetimeCount: 1, requestedMaxKeepAliveCount: 7,
  publishingEnabled: true,
});
seen.revised = [subscription.publishingInterval, subscription.lifetimeCount, subscription.maxKeepAliveCount];
const monitored = async (nodeId, filter, attributeId = AttributeIds.Value) => {
  const item = await subscription.monitor(
    { nodeId, attributeId }, { samplingInterval: -1, queueSize: 1000, discardOldest: true, filter },
    TimestampsToReturn.Both).catch((error) => error);
  return item.statusCode?.name ?? /Bad\w+/.exec(item.message)?.[0] ?? String(item);
};
const percent = (deadbandValue) => new DataChangeFilter({
  trigger: DataChangeTrigger.StatusValue, deadbandType: DeadbandType.Percent, deadbandValue,
});
seen.percent = await monitored(id("conveyor/fu1/actual/frequency"), percent(5));
seen.beyond = await monitored(id("conveyor/fu1/actual/frequency"), percent(101));
seen.rangeless = await monitored(id("conveyor/fu1/status/state"), percent(5));
seen.events = await monitored(
  "i=2253", constructEventFilter(["EventType", "Message"], ofType("i=2041")), AttributeIds.EventNotifier);

const watch = (nodeId, monitoringMode) => subscription.monitor(
  { nodeId, attributeId: AttributeIds.Value }, { samplingInterval: -1, queueSize: 1, discardOldest: true },
  TimestampsToReturn.Both, monitoringMode);
const sampled = await watch("i=2255", MonitoringMode.Sampling);
const linked = new Promise((resolve) => sampled.on("changed", (value) => resolve(value.value.value.length > 1)));
// The time changes each second.
const clock = await watch("i=2258", MonitoringMode.Sampling);
const links = await subscription.setTriggering(clock, [sampled], []);
seen.links = links.addResults.map((code) => code.name);
seen.linked = await linked;

await subscription.terminate();
await session.close();
await client.disconnect();
console.log(JSON.stringify(seen));
