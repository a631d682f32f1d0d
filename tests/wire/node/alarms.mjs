// Follows alarms node-opcua's way, and handles the first that comes, with a comment in German; prints lines of JSON.
// node alarms.mjs URL USER PASSWORD
import {
  DataType, LocalizedText, MessageSecurityMode, OPCUAClient, SecurityPolicy, UserTokenType, Variant, installAlarmMonitoring,
} from "node-opcua-client";

const [url, userName, password] = process.argv.slice(2);
const say = (line) => console.log(JSON.stringify(line));
const client = OPCUAClient.create({
  endpointMustExist: false, connectionStrategy: { maxRetry: 0 },
  securityMode: MessageSecurityMode.None, securityPolicy: SecurityPolicy.None,
});
await client.connect(url);
const session = await client.createSession({ type: UserTokenType.UserName, userName, password });
const alarms = await installAlarmMonitoring(session);

const changed = (fits) => new Promise((resolve) => {
  const look = (alarm) => {
    if (!fits(alarm.fields)) return;
    alarms.removeListener("alarmChanged", look);
    alarms.removeListener("newAlarm", look);
    resolve(alarm);
  };
  alarms.on("newAlarm", look);
  alarms.on("alarmChanged", look);
});
const raised = changed((fields) => fields.activeState.id.value);
say({ monitoring: true });
const alarm = await raised;
const { message, severity, sourceName, eventId, retain } = alarm.fields;
say({
  message: message.value.text, severity: severity.value, source: sourceName.value,
  retain: retain.value,
});
const comment = new LocalizedText({ text: "gesehen, Kabel wird getauscht", locale: "de" });
const acked = changed((fields) => fields.ackedState.id.value);
const calls = [(await session.acknowledgeCondition(alarm.conditionId, eventId.value, comment)).name];
const after = (await acked).fields;
say({ acked: after.ackedState.value.text, comment: after.comment.value.text, locale: after.comment.value.locale, user: after.clientUserId.value });
calls.push((await session.confirmCondition(alarm.conditionId, after.eventId.value, "")).name);
calls.push((await session.acknowledgeCondition(alarm.conditionId, eventId.value, comment)).name);
const shelved = changed((fields) => fields.suppressedOrShelved.value);
const result = await session.call({
  objectId: alarm.conditionId, methodId: "i=2949",
  inputArguments: [new Variant({ dataType: DataType.Double, value: 60_000 })],
});
calls.push(result.statusCode.name);
say({ shelved: (await shelved).fields.shelvingState.currentState.value.text });
say({ calls });
await session.close();
await client.disconnect();
