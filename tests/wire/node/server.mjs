// node-opcua's server with the address space of the comparison: node server.mjs PORT < nodes.json
// It says "port PORT" once it listens. The nodes are those of tests/compare/space.py.
import { readFileSync } from "node:fs";
import * as opcua from "node-opcua-server";
import { VariableHistorian } from "node-opcua-address-space";
import { DataType, Variant, VariantArrayType } from "node-opcua-variant";
import { DataValue } from "node-opcua-data-value";
import { StatusCodes } from "node-opcua-status-code";
import { MessageSecurityMode, SecurityPolicy } from "node-opcua-secure-channel";

const port = Number(process.argv[2]);
const made = JSON.parse(readFileSync(0, "utf8"));
const named = (id) => id.split("/").at(-1);

const server = new opcua.OPCUAServer({
  port,
  disableDiscovery: true,
  securityModes: [MessageSecurityMode.None],
  securityPolicies: [SecurityPolicy.None],
  allowAnonymous: true,
  maxConnectionsPerEndpoint: 200,
  serverCapabilities: { maxSessions: 200, minSupportedSampleRate: 0 },
});
await server.initialize();
const space = server.engine.addressSpace;
const namespaces = [null, space.getOwnNamespace(), space.registerNamespace("urn:drivebridge:points")];
if (namespaces[1].index !== 1 || namespaces[2].index !== 2) throw new Error("other namespaces");

const nodes = new Map();
const parent = (one) => nodes.get(one.parent) ?? space.rootFolder.objects;

for (const one of made.objects) {
  const node = namespaces[one.namespace].addObject({
    browseName: named(one.id),
    nodeId: `s=${one.id}`,
    organizedBy: parent(one),
    typeDefinition: one.is_folder ? "FolderType" : "BaseObjectType",
    eventNotifier: one.notifies ? 1 : 0,
  });
  if (one.notifies) space.rootFolder.objects.server.addReference({ referenceType: "HasNotifier", nodeId: node });
  nodes.set(one.id, node);
}
for (const one of made.variables) {
  const array = Array.isArray(one.value);
  const value = {
    dataType: DataType[one.type],
    arrayType: array ? VariantArrayType.Array : VariantArrayType.Scalar,
    value: one.value,
  };
  const options = {
    browseName: named(one.id),
    nodeId: `s=${one.id}`,
    componentOf: parent(one),
    dataType: one.type,
    valueRank: array ? 1 : -1,
    accessLevel: one.access,
    userAccessLevel: one.access,
    minimumSamplingInterval: 0,
    value: new Variant(value),
  };
  const namespace = namespaces[one.namespace];
  if (one.range) {
    const [low, high] = one.range;
    namespace.addAnalogDataItem({ ...options, engineeringUnitsRange: { low, high } });
  } else namespace.addVariable(options);
}
for (const one of made.histories) {
  const { variable, samples } = one;
  const node = namespaces[1].addVariable({
    browseName: named(variable.id),
    nodeId: `s=${variable.id}`,
    componentOf: parent(variable),
    dataType: variable.type,
    accessLevel: variable.access,
    userAccessLevel: variable.access,
  });
  const historian = new VariableHistorian(node, { maxOnlineValues: 1000 });
  space.installHistoricalDataNode(node, { historian });
  for (const sample of samples) {
    await historian.push(
      new DataValue({
        value: { dataType: DataType[variable.type], value: sample.value },
        statusCode: StatusCodes[sample.status],
        sourceTimestamp: new Date(sample.at),
      }),
    );
  }
}
const argument = ([name, type]) => ({ name, dataType: DataType[type], valueRank: -1 });
// An empty list would make a property without arguments, which the other servers do not have.
const listed = (one) => (Object.keys(one).length ? Object.entries(one).map(argument) : undefined);
for (const one of made.methods) {
  const method = namespaces[one.namespace].addMethod(parent(one), {
    browseName: named(one.id),
    nodeId: `s=${one.id}`,
    componentOf: parent(one),
    inputArguments: listed(one.inputs),
    outputArguments: listed(one.outputs),
  });
  method.bindMethod((inputs, _context, callback) => {
    const outputArguments = [];
    if (named(one.id) === "add") {
      const sum = inputs.reduce((all, input) => all + input.value, 0) | 0;
      outputArguments.push({ dataType: DataType.Int32, value: sum });
    }
    if (named(one.id) === "emit") {
      parent(one).raiseEvent("BaseEventType", {
        message: { dataType: DataType.LocalizedText, value: { text: "emitted" } },
        severity: { dataType: DataType.UInt16, value: inputs[0].value },
      });
    }
    if (one.outputs.outcome) {
      outputArguments.push({ dataType: DataType.LocalizedText, value: { locale: "en", text: "done" } });
    }
    callback(null, { statusCode: StatusCodes.Good, outputArguments });
  });
}
space.installAlarmsAndConditionsService();
const source = namespaces[1].addObject({
  browseName: "source",
  nodeId: `s=${made.alarm.replace(/\/[^/]*$/, "")}`,
  organizedBy: space.rootFolder.objects,
  eventSourceOf: space.rootFolder.objects.server,
  eventNotifier: 1,
});
const alarm = namespaces[1].instantiateAlarmCondition("AlarmConditionType", {
  browseName: named(made.alarm),
  nodeId: `s=${made.alarm}`,
  componentOf: source,
  conditionSource: source,
  inputNode: source,
  optionals: ["ConfirmedState", "Confirm"],
});
const raising = namespaces[1].addMethod(source, {
  browseName: named(made.raise),
  nodeId: `s=${made.raise}`,
  componentOf: source,
  outputArguments: [argument(["event", "ByteString"])],
});
raising.bindMethod((_inputs, _context, callback) => {
  const branch = alarm.currentBranch();
  alarm.activateAlarm();
  branch.setAckedState(false);
  branch.setConfirmedState(true);
  branch.setComment({ text: "" });
  alarm.raiseNewCondition({ message: "raised", severity: 500, retain: true });
  callback(null, {
    statusCode: StatusCodes.Good,
    outputArguments: [{ dataType: DataType.ByteString, value: branch.getEventId() }],
  });
});
await server.start();
console.log(`port ${port}`);
