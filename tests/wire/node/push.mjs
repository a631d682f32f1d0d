// Renews the server's certificate with node-opcua's client, as a tool of a plant's authority does.
// node push.mjs URL USER PASSWORD: prints the request, reads the certificate as a line, both in base64, and
// prints what came of it on the session that it has had all the time.
import { createInterface } from "node:readline/promises";

import { DataType, MessageSecurityMode, OPCUAClient, SecurityPolicy, UserTokenType, VariantArrayType }
  from "node-opcua-client";
import { coerceNodeId } from "node-opcua-nodeid";

const CONFIGURATION = "i=12637", GROUP = "i=14156", RSA_SHA256 = "i=12560";
const [url, userName, password] = process.argv.slice(2);
const client = OPCUAClient.create({
  endpointMustExist: false, connectionStrategy: { maxRetry: 0 },
  securityMode: MessageSecurityMode.SignAndEncrypt, securityPolicy: SecurityPolicy.Basic256Sha256,
});
await client.connect(url);
const session = await client.createSession({ type: UserTokenType.UserName, userName, password });
const call = (methodId, ...inputArguments) => session.call({ objectId: CONFIGURATION, methodId, inputArguments });
const nodeId = (value) => ({ dataType: DataType.NodeId, value: coerceNodeId(value) });
const text = (value) => ({ dataType: DataType.String, value });
const bytes = (value) => ({ dataType: DataType.ByteString, value });

const request = await call("i=12737", nodeId(GROUP), nodeId(RSA_SHA256), text(""),
  { dataType: DataType.Boolean, value: true }, bytes(Buffer.alloc(32, 7)));
console.log(JSON.stringify({ request: request.outputArguments[0].value.toString("base64") }));

const lines = createInterface({ input: process.stdin });
const [certificate, issuer] = (await lines[Symbol.asyncIterator]().next()).value.split(" ");
const updated = await call("i=13737", nodeId(GROUP), nodeId(RSA_SHA256), bytes(Buffer.from(certificate, "base64")),
  { dataType: DataType.ByteString, arrayType: VariantArrayType.Array, value: [Buffer.from(issuer, "base64")] },
  text(null), bytes(null));
const applied = await call("i=12740");
const state = await session.read({ nodeId: "i=2259" });
const endpoints = await client.getEndpoints();
console.log(JSON.stringify({
  updated: updated.statusCode.name, required: updated.outputArguments[0].value, applied: applied.statusCode.name,
  state: state.statusCode.name, shown: endpoints[0].serverCertificate.toString("base64"),
}));
lines.close();
await session.close();
await client.disconnect();
