// A day of node-opcua's client, one JSON line for each step: node_steps.py has what each has to say.
// node scenario.mjs LETTER FOLDER URL COMMANDS
import { readFileSync } from "node:fs";
import { join } from "node:path";

import {
  AttributeIds, DataChangeFilter, DataChangeTrigger, DataType, DeadbandType, HistoryReadRequest,
  LocalizedText, MonitoringMode, OPCUAClient, ReadAtTimeDetails, ReadEventDetails, TimestampsToReturn,
  UserTokenType, constructEventFilter, makeBrowsePath,
} from "node-opcua-client";
import { RepublishRequest, TransferSubscriptionsRequest } from "node-opcua-service-subscription";

import {
  anna, breakPlant, bus, codeOf, entered, first, folder, id, inside, letter, name, outcome, pause, prepared,
  requests, say, second, sockets, space, step, text, url, user,
} from "./scenario_client.mjs";

async function discovery() {
  const client = OPCUAClient.create({ endpointMustExist: false, connectionStrategy: { maxRetry: 0 } });
  await client.connect(url);
  const [server] = await client.findServers();
  step("application", server.applicationUri);
  step("kind of application", server.applicationType);
  step("addresses", server.discoveryUrls.length === 1 && server.discoveryUrls[0] === url);
  const endpoints = await client.getEndpoints();
  step("policies", endpoints.map((one) => one.securityPolicyUri.split("#")[1]));
  step("modes", [...new Set(endpoints.map((one) => one.securityMode))]);
  step("identities", [...new Set(endpoints.flatMap((one) => one.userIdentityTokens.map((token) => token.tokenType)))].sort());
  await client.disconnect().catch(() => undefined);
}

async function certificates() {
  const shown = ["untrusted", "weak key", "no issuer", "expired", "not yet valid", "wrong uri", "wrong usage", "revoked",
    "of authority", "trusted"];
  for (const one of shown) step(`certificate: ${one}`, await entered(anna, one));
}

async function users() {
  const by = (person) => ({
    type: UserTokenType.Certificate, certificateData: readFileSync(join(folder, `${person}.der`)),
    privateKey: readFileSync(join(folder, `${person}.pem`), "latin1"),
  });
  step("wrong password", await entered({ ...anna, password: "sardine" }));
  step("unknown user", await entered(user("udo")));
  step("user with a certificate", await entered(by("carl")));
  step("certificate of no user", await entered(by("otto")));
}

async function roles() {
  const [drive, one] = [`${first}/fu4`, `${first}/fu1`];
  const [alarm, setpoint] = [`${drive}/Alarm`, `${drive}/command/setpoint_1`];
  const [enable, disable, shelve] = ["i=9027", "i=9028", "i=9212"];
  const p102 = [DataType.String, "P102"];
  const value = [DataType.Double, 2.5];
  await inside("otto", async (otto) => {
    step("observer reads", await otto.value(`${one}/parameter/p105`));
    step("observer writes", await otto.write(setpoint, DataType.UInt16, 1));
    step("observer starts", await otto.call(drive, "Start", [DataType.Int32, 1]));
    step("observer stops", await otto.call(drive, "Stop"));
    step("observer resets a node", await otto.call(second, "Reset"));
    step("observer shelves", await otto.call(alarm, shelve));
    step("observer reads a parameter", await otto.call(one, "ReadParameter", p102));
  });
  await inside("anna", async (operator) => {
    step("operator writes", await operator.write(setpoint, DataType.UInt16, 1));
    step("operator sets a parameter", await operator.call(one, "WriteParameter", p102, value));
    step("operator saves", await operator.call(one, "SaveParameters"));
    step("operator disables an alarm", await operator.call(alarm, disable));
  });
  await inside("eva", async (engineer) => {
    const [code, said] = await engineer.call(one, "WriteParameter", p102, value);
    step("engineer sets a parameter", [code, text(said)]);
    step("engineer reads it", await engineer.call(one, "ReadParameter", p102));
    step("engineer disables an alarm", await engineer.call(alarm, disable));
    step("engineer enables it", await engineer.call(alarm, enable));
    step("engineer sees who was refused", await engineer.call("i=12637", "i=12777"));
  });
  await inside("ida", async (admin) => {
    const [code, found] = await admin.call("i=12637", "i=12777");
    step("admin sees who was refused", [code, found.length > 0]);
  });
}

// The drive by published types alone, without a name of ours.
async function model({ session, value }) {
  const spaces = await session.readNamespaceArray();
  const [di, powertrain] = ["DI", "Powertrain"].map((one) => spaces.indexOf(`http://opcfoundation.org/UA/${one}/`));
  const target = async (start, path) => {
    const result = await session.translateBrowsePath(makeBrowsePath(start, path));
    return result.targets[0].targetId;
  };
  const read = async (start, path) => {
    const data = await session.read({ nodeId: await target(start, path), attributeId: AttributeIds.Value });
    return data.statusCode.isGood() ? data.value.value : data.statusCode.name;
  };
  const names = async (where) => (await session.browse(where)).references.map((one) => one.browseName.name);
  const devices = await target("i=85", `/${di}:DeviceSet`);
  step("assets", (await names(devices)).filter((one) => one.startsWith(letter)));
  const found = (await session.browse(devices)).references.find((one) => one.browseName.name === `${first}/fu1`);
  const asset = found.nodeId.toString();
  const kind = await session.read({ nodeId: found.typeDefinition, attributeId: AttributeIds.BrowseName });
  step("type of asset", [kind.value.value.namespaceIndex === powertrain, kind.value.value.name]);
  step("manufacturer", text(await read(asset, `/${di}:Manufacturer`)));
  step("model", text(await read(asset, `/${di}:Model`)));
  step("software", await read(asset, `/${di}:SoftwareRevision`));
  step("serial number", await read(asset, `/${di}:SerialNumber`));
  step("identification", (await read(asset, `/${di}:Identification/${di}:ComponentName`)).text);
  step("health", await read(asset, `/${di}:DeviceHealth`));
  const unit = await read(asset, `/${di}:Operational/${space}:MainActualValue/0:EngineeringUnits`);
  step("unit", [unit.displayName.text, unit.unitId]);
  step("methods", (await names(await target(asset, `/${di}:MethodSet`))).slice(0, 5));
}

async function moving(operator) {
  const drive = `${first}/fu1`;
  const setpoint = `${drive}/command/setpoint_1`;
  step("at first", await operator.value(`${drive}/status/state`));
  step("out of range", await operator.write(setpoint, DataType.UInt32, 70000));
  step("of a wrong type", await operator.write(setpoint, DataType.String, "fast"));
  step("what is only read", await operator.write(`${drive}/status/status_word`, DataType.UInt16, 1));
  step("set-point", await operator.write(`${drive}/command/frequency`, DataType.Double, 20));
  const [code, said] = await operator.call(drive, "Start", [DataType.Int32, 1]);
  step("start", [code, text(said)]);
  step("enabled", await operator.value(`${drive}/status/state`));
  step("owner", await operator.value(`${drive}/supervision/owner`));
  step("speed", Math.round(await operator.until(`${drive}/actual/frequency`, (hz) => hz >= 19.5 && hz <= 20.5)));
  step("stop", (await operator.call(drive, "Stop"))[0]);
  step("standstill", await operator.until(`${drive}/actual/frequency`, (hz) => hz === 0));
}

async function language(words, operator) {
  const state = `${first}/fu1/status/state`;
  step(`state in ${words}`, text(await operator.value(state, AttributeIds.DisplayName)));
  step(`its states in ${words}`, (await operator.value(`${state}/EnumStrings`))[4].text);
  step(`method in ${words}`, text(await operator.value(`${first}/fu1/QuickStop`, AttributeIds.DisplayName)));
}

const FIELDS = ["EventId", "EventType", "SourceName", "Message", "Severity", "Retain", "ActiveState.Id", "AckedState",
  "AckedState.Id", "ConfirmedState.Id", "Comment", "ClientUserId"];

async function alarms(operator) {
  const drive = `${first}/fu1`;
  const alarm = id(`${drive}/Alarm`);
  const { session } = operator;
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 50, requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 10, publishingEnabled: true,
  });
  let events = [];
  const item = await subscription.monitor(
    { nodeId: "i=2253", attributeId: AttributeIds.EventNotifier },
    { samplingInterval: 0, queueSize: 200, discardOldest: true, filter: constructEventFilter(FIELDS) },
    TimestampsToReturn.Both);
  item.on("changed", (fields) => events.push(Object.fromEntries(FIELDS.map((one, place) => [one, fields[place].value]))));
  const event = async (source, fits) => {
    for (let wait = 0; wait < 2000; wait += 1) {
      const found = events.find((one) => (!source || one.SourceName === source) && fits(one));
      if (found) return found;
      await pause(20);
    }
    throw new Error(`nothing told of ${source}`);
  };
  await breakPlant(`fail_drive ${first}`);
  // Until its number has been read there is only the emergency's.
  const raised = await event(drive, (one) => one["ActiveState.Id"] && one.Message.text.includes("E003/3.0"));
  step("alarm", [raised.SourceName, raised.Severity, raised.Retain]);
  step("its message", text(raised.Message));
  step("its cause", (await operator.value(`${drive}/Alarm/Cause`)).text.split(",")[0]);
  step("its remedy", (await operator.value(`${drive}/Alarm/Remedy`)).text.split(",")[0]);
  step("its code", await operator.value(`${drive}/Alarm/Code`));
  step("its state", text(raised.AckedState));
  const comment = new LocalizedText({ text: "Förderband geprüft", locale: "de" });
  step("acknowledge", name(await session.acknowledgeCondition(alarm, raised.EventId, comment)));
  const acked = await event(drive, (one) => one["AckedState.Id"]);
  step("acknowledged", [...text(acked.AckedState), acked.ClientUserId]);
  step("comment", text(acked.Comment));
  step("acknowledge twice", name(await session.acknowledgeCondition(alarm, raised.EventId, comment)));
  step("acknowledge nothing", name(await session.acknowledgeCondition(alarm, Buffer.from("nothing"), comment)));
  step("shelve", await operator.call(alarm, "i=9213", [DataType.Double, 60_000]));
  step("unshelve", await operator.call(alarm, "i=9211"));
  step("unshelve twice", await operator.call(alarm, "i=9211"));
  events = [];
  step("refresh", await operator.call("i=2782", "i=3875", [DataType.UInt32, subscription.subscriptionId]));
  await event("", (one) => one.EventType.toString() === "ns=0;i=2788");
  // An event of the plant may come before: it is none of the refresh.
  const refresh = events.slice(events.findIndex((one) => one.EventType.toString() === "ns=0;i=2787"));
  step("refresh begins", refresh[0].EventType.toString());
  step("refreshed", refresh.some((one) => one.SourceName === drive));
  step("reset of the fault", (await operator.call(drive, "ResetFault"))[0]);
  const over = await event(drive, (one) => one["ActiveState.Id"] === false);
  step("over", [over.Retain, ...text(over.Message)]);
  step("confirm", name(await session.confirmCondition(alarm, over.EventId, "")));
  step("dealt with", (await event(drive, (one) => !one.Retain && one["ActiveState.Id"] === false))["ConfirmedState.Id"]);

  events = [];
  await breakPlant(`cut_cable ${bus}`);
  const silent = await event(bus, (one) => one["ActiveState.Id"]);
  step("cut bus", silent.Message.text.split(":")[0]);
  step("what it explains", (await operator.value(`bus/${bus}/Alarm/Explains`)).toSorted());
  await breakPlant(`mend_cable ${bus}`);
  step("bus is back", (await event(bus, (one) => one["ActiveState.Id"] === false))["ActiveState.Id"]);
  await subscription.terminate();
}

async function history({ session }, began) {
  const frequency = id(`${first}/fu1/actual/frequency`);
  const end = new Date(Date.now() + 1000);
  const raw = async (where, from, to, more = {}) => (
    await session.readHistoryValue([where], from, to, { returnBounds: false, ...more }))[0];
  const values = ({ historyData }) => historyData.dataValues.map((one) => one.value.value);
  const forwards = values(await raw(frequency, began, end));
  step("history goes up and down", [forwards.at(-1), Math.round(Math.max(...forwards))]);
  step("history backwards", String(values(await raw(frequency, end, began)).reverse()) === String(forwards));
  const [last] = (await raw(frequency, end, began, { numValuesPerNode: 1 })).historyData.dataValues;
  const at = async (details) => (await session.historyRead(new HistoryReadRequest({
    historyReadDetails: details, nodesToRead: [{ nodeId: frequency }], timestampsToReturn: TimestampsToReturn.Both,
  }))).results[0];
  // A Date has milliseconds only.
  const reqTimes = [new Date(last.sourceTimestamp.getTime() + 1)];
  step("history at a time", values(await at(new ReadAtTimeDetails({ reqTimes, useSimpleBounds: true }))));
  step("what has no history", (await raw(id(`${first}/fu1/status/fault_text`), began, end)).statusCode.name);
  const past = await session.historyRead(new HistoryReadRequest({
    historyReadDetails: new ReadEventDetails({
      startTime: began, endTime: end, numValuesPerNode: 1000, filter: constructEventFilter(["SourceName", "Message"]),
    }),
    nodesToRead: [{ nodeId: "i=2253" }], timestampsToReturn: TimestampsToReturn.Both,
  }));
  const said = past.results[0].historyData.events
    .map((one) => one.eventFields.map(({ value }) => value.text ?? value))
    .filter(([source, message]) => source === `${first}/fu1` && message.includes("berstrom"));
  step("events of the past", [...new Set(said.map(([, message]) => message))]);
}

async function blackBox(operator) {
  const file = `${first}/fu1/BlackBox/1`;
  const size = Number((await operator.until(`${file}/Size`, (value) => value[1] > 0))[1]);
  step("open for writing", await operator.call(file, "i=11580", [DataType.Byte, 2]));
  const [code, handle] = await operator.call(file, "i=11580", [DataType.Byte, 1]);
  step("open for reading", code);
  const [read, content] = await operator.call(file, "i=11585", [DataType.UInt32, handle], [DataType.Int32, size]);
  step("black box", [read, content.length === size]);
  step("its first column", content.toString("utf8").replace(/^\uFEFF/, "").split(",")[0]);
  step("close", await operator.call(file, "i=11583", [DataType.UInt32, handle]));
}

const watching = (subscription, where, more = {}, mode = MonitoringMode.Reporting) => subscription.monitor(
  { nodeId: id(where), attributeId: AttributeIds.Value },
  { samplingInterval: 50, queueSize: 10, discardOldest: true, ...more }, TimestampsToReturn.Both, mode);
const subscribed = (session, interval = 50, lifetime = 1000, keepAlive = 10) => session.createSubscription2({
  requestedPublishingInterval: interval, requestedLifetimeCount: lifetime, requestedMaxKeepAliveCount: keepAlive,
  publishingEnabled: true,
});

async function subscriptions(operator) {
  const setpoint = `${first}/fu3/command/setpoint_1`;
  const made = await subscribed(operator.session, 1, 1, 7);
  step("revised subscription", [made.publishingInterval, made.lifetimeCount, made.maxKeepAliveCount]);
  const deadband = (deadbandType, deadbandValue) => ({
    filter: new DataChangeFilter({ trigger: DataChangeTrigger.StatusValue, deadbandType, deadbandValue }),
  });
  const percent = (where, value) => watching(made, where, deadband(DeadbandType.Percent, value)).then(
    (item) => item.statusCode?.name ?? codeOf(item), codeOf);
  step("percent of a state", await percent(`${first}/fu1/status/state`, 5));
  step("more than all", await percent(`${first}/fu1/actual/frequency`, 101));
  step("percent of a range", await percent(`${first}/fu1/actual/frequency`, 5));
  const words = [];
  const item = await watching(made, setpoint, deadband(DeadbandType.Absolute, 500));
  item.on("changed", (data) => words.push(data.value.value));
  for (const word of [1000, 1200, 2000]) {
    await pause(300);
    await operator.write(setpoint, DataType.UInt16, word);
  }
  await pause(300);
  step("within a deadband of 500", words);
  const sampled = await watching(made, "i=2255", {}, MonitoringMode.Sampling);
  const linked = new Promise((resolve) => sampled.on("changed", (data) => resolve(data.value.value[0])));
  step("links", (await made.setTriggering(item, [sampled], [])).addResults.map(name));
  await operator.write(setpoint, DataType.UInt16, 3000);
  step("triggered", await linked);
  await made.terminate();
}

// Its connection is lost: it comes back to its session by itself and asks for what it has missed.
async function lostConnection() {
  const setpoint = `${first}/fu3/command/setpoint_1`;
  const client = prepared("trusted", "en", 100);
  const sent = {};
  client.on("send_request", (request) => {
    sent[request.constructor.name] = (sent[request.constructor.name] ?? 0) + 1;
  });
  const before = new Set(sockets);
  await client.connect(url);
  const session = await client.createSession(anna);
  const operator = requests(session);
  const subscription = await subscribed(session);
  const words = [];
  (await watching(subscription, setpoint)).on("changed", (data) => words.push(data.value.value));
  for (let wait = 0; wait < 100 && !words.length; wait += 1) await pause(50);
  const back = new Promise((resolve) => client.once("connection_reestablished", resolve));
  for (const socket of sockets) if (!before.has(socket)) socket.destroy(new Error("ECONNRESET"));
  await back;
  await operator.write(setpoint, DataType.UInt16, 4000);
  for (let wait = 0; wait < 100 && words.at(-1) !== 4000; wait += 1) await pause(50);
  step("after a lost connection", words);
  step("sessions it has made", sent.CreateSessionRequest);
  step("subscriptions it has made", sent.CreateSubscriptionRequest);
  step("it has asked for what it missed", sent.RepublishRequest >= 1);
  const { subscriptionId } = subscription;
  const republish = (retransmitSequenceNumber) => outcome(() => session.republish(
    new RepublishRequest({ subscriptionId, retransmitSequenceNumber })));
  step("nothing more to republish", await republish(99));
  const moved = async (by, subscriptionIds = [subscriptionId]) => {
    const request = new TransferSubscriptionsRequest({ subscriptionIds, sendInitialValues: true });
    return (await by.session.transferSubscriptions(request)).results[0].statusCode.name;
  };
  await inside("otto", async (stranger) => step("transfer to somebody else", await moved(stranger)));
  await inside("anna", async (other) => {
    step("transfer of nothing", await moved(other, [4711]));
    step("transfer", await moved(other));
  });
  await session.close(false);
  await client.disconnect();
}

async function diagnostics() {
  const [every, secret] = ["i=3707", "i=3708"];
  await inside("anna", async (operator) => {
    const summary = await operator.value("i=2275");
    step("sessions are counted", summary.currentSessionCount >= 1);
    step("refused sessions are counted", summary.securityRejectedSessionCount >= 1);
    step("sessions for an operator", await operator.value(every));
    step("secrets for an operator", await operator.value(secret));
  });
  await inside("eva", async (engineer) => {
    const found = await engineer.value(every);
    step("sessions for an engineer", found.some((one) => one.clientDescription.applicationUri === "urn:test:client"));
    const secrets = await engineer.value(secret);
    step("secrets for an engineer", secrets.some((one) => one.clientUserIdHistory.includes("eva")));
  });
}

// What is set at the drive itself is known once somebody asks the drive.
async function readThrough({ session }) {
  const read = async (maxAge) => {
    const nodesToRead = [{ nodeId: id(`${first}/fu1/parameter/p102`), attributeId: AttributeIds.Value }];
    const [data] = await session.read(nodesToRead, maxAge);
    return data.value.value;
  };
  await breakPlant(`turn_knob ${first} 700`);
  await pause(200);
  step("as it was read last", await read(600_000));
  step("as the drive has it", await read(0));
  step("as it was read then", await read(600_000));
}

async function end(operator) {
  const seen = [];
  const subscription = await subscribed(operator.session);
  const followed = { level: "i=2267", state: "i=2259", seconds: "i=2992", reason: "i=2993" };
  for (const [what, where] of Object.entries(followed)) {
    (await watching(subscription, where)).on("changed", (data) => seen.push([what, data.value.value]));
  }
  while (seen.length < 4) await pause(50);
  step("service level", seen.find(([what]) => what === "level")[1]);
  seen.length = 0;
  say({ waiting: "end" });
  const has = (what) => seen.find(([one]) => one === what)?.[1];
  while (has("level") === undefined || has("reason") === undefined) await pause(20);
  step("service level at the end", has("level"));
  step("state", has("state"));
  step("seconds till shutdown", has("seconds"));
  step("reason", text(has("reason")));
  const kinds = new Set();
  for (let wait = 0; wait < 100; wait += 1) {
    const value = await operator.value(`${first}/fu1/status/status_word`).catch(() => "closed");
    if (value === "closed") break;
    kinds.add(typeof value);
    await pause(100);
  }
  step("no Bad before the end", [...kinds]);
  step("counted down", seen.filter(([what]) => what === "seconds").map(([, value]) => value).slice(0, 2));
}

const began = new Date();
await discovery();
await certificates();
await users();
await roles();
await inside("anna", async (operator) => {
  await model(operator);
  await moving(operator);
  await language("English", operator);
});
await inside("anna", async (operator) => {
  await language("German", operator);
  await alarms(operator);
  await blackBox(operator);
  await history(operator, began);
}, "de");
await inside("anna", subscriptions);
await lostConnection();
await diagnostics();
await inside("anna", readThrough);
const client = prepared("trusted", "de");
await client.connect(url);
await end(requests(await client.createSession(anna)));
process.exit(0);
