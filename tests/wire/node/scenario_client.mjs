// What node-opcua's scenario uses: its client with certificates and languages, steps, and the plant.
import { createSocket } from "node:dgram";
import { Socket } from "node:net";
import { join } from "node:path";

import { OPCUACertificateManager } from "node-opcua-certificate-manager";
import {
  AttributeIds, MessageSecurityMode, OPCUAClient, SecurityPolicy, UserTokenType, Variant,
} from "node-opcua-client";
import { getStatusCodeFromCode } from "node-opcua-status-code";

export const [letter, folder, url, commands] = process.argv.slice(2);
export const [first, second] = [`${letter}1`, `${letter}2`];
export const bus = `can${letter.charCodeAt(0) - 97}`;
export const say = (what) => process.stdout.write(`${JSON.stringify(what)}\n`);
export const step = (name, got) => say({ step: name, got });
export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
export const breakPlant = (words) => new Promise((resolve) => {
  const out = createSocket("udp4");
  out.send(words, Number(commands), "127.0.0.1", () => out.close(resolve));
});
export const text = (one) => [one.locale, one.text];
export const name = (code) => code.name;

// The client itself says only that it has been disconnected; and sockets are lost on purpose.
let told = "";
export const sockets = new Set();
const { emit } = Socket.prototype;
Socket.prototype.emit = function heard(event, data, ...more) {
  if (event === "connect") sockets.add(this);
  if (event === "close") sockets.delete(this);
  if (event === "data" && data.toString("latin1", 0, 3) === "ERR") {
    told = getStatusCodeFromCode(data.readUInt32LE(8)).name;
  }
  return emit.call(this, event, data, ...more);
};

const clientCertificateManager = new OPCUACertificateManager({
  rootFolder: join(folder, "pki"), automaticallyAcceptUnknownCertificate: true,
});
await clientCertificateManager.initialize();
export const anna = { type: UserTokenType.UserName, userName: "anna", password: "swordfish" };
export const user = (userName) => ({ ...anna, userName });

// It sends no languages of its own: they are put into its requests.
export const prepared = (certificate = "trusted", locale = "en", maxRetry = 0) => {
  const client = OPCUAClient.create({
    applicationUri: "urn:test:client", clientCertificateManager, endpointMustExist: false, keepSessionAlive: false,
    certificateFile: join(folder, "shown", `${certificate}.der`),
    privateKeyFile: join(folder, "shown", `${certificate}.pem`),
    connectionStrategy: { initialDelay: 100, maxDelay: 300, maxRetry },
    securityMode: MessageSecurityMode.SignAndEncrypt, securityPolicy: SecurityPolicy.Basic256Sha256,
  });
  client.on("send_request", (request) => {
    if (request.constructor.name === "ActivateSessionRequest") request.localeIds = [locale];
    // Else it is whatever its certificate says.
    if (request.constructor.name === "CreateSessionRequest") request.clientDescription.applicationUri = "urn:test:client";
  });
  return client;
};
export const codeOf = (error) => told || (/Bad[A-Za-z]+/.exec(error.message)?.[0] ?? error.message);
export const outcome = async (work) => {
  told = "";
  try { await work(); return "Good"; } catch (error) { return codeOf(error); }
};
export const entered = async (identity, certificate) => {
  const client = prepared(certificate);
  const code = await outcome(async () => {
    await client.connect(url);
    await (await client.createSession(identity)).close();
  });
  await client.disconnect().catch(() => undefined);
  return code;
};

export let space = 0;
export const id = (where) => (/^(i|ns)=/.test(where) ? where : `ns=${space};s=${where}`);
export const requests = (session) => ({
  session,
  async value(where, attributeId = AttributeIds.Value) {
    const data = await session.read({ nodeId: id(where), attributeId });
    return data.statusCode.isGood() ? data.value.value : data.statusCode.name;
  },
  async write(where, dataType, value) {
    const data = { nodeId: id(where), attributeId: AttributeIds.Value, value: { value: new Variant({ dataType, value }) } };
    return (await session.write(data)).name;
  },
  async call(where, method, ...given) {
    const inputArguments = given.map(([dataType, value]) => new Variant({ dataType, value }));
    const methodId = method.startsWith("i=") ? method : id(`${where}/${method}`);
    const result = await session.call({ objectId: id(where), methodId, inputArguments });
    return [result.statusCode.name, ...(result.outputArguments ?? []).map((one) => one.value)];
  },
  async until(where, fits) {
    let value;
    for (let wait = 0; wait < 200 && !fits(value = await this.value(where)); wait += 1) await pause(50);
    return value;
  },
});
export const inside = async (userName, work, locale = "en") => {
  const client = prepared("trusted", locale);
  await client.connect(url);
  const session = await client.createSession(user(userName));
  space ||= (await session.readNamespaceArray()).indexOf("urn:drivebridge:points");
  await work(requests(session), client);
  await session.close();
  await client.disconnect();
};
