// Shows node-opcua's client with each certificate of a folder to the server, and prints what came of it.
// node certificates.mjs URL FOLDER APPLICATION_URI USER PASSWORD: NAME.der and NAME.pem for each.
import { readdirSync } from "node:fs";
import { Socket } from "node:net";
import { join } from "node:path";

import { OPCUACertificateManager } from "node-opcua-certificate-manager";
import { MessageSecurityMode, OPCUAClient, SecurityPolicy, UserTokenType } from "node-opcua-client";
import { getStatusCodeFromCode } from "node-opcua-status-code";

const [url, folder, applicationUri, userName, password] = process.argv.slice(2);
const clientCertificateManager = new OPCUACertificateManager({
  rootFolder: join(folder, "pki"), automaticallyAcceptUnknownCertificate: true,
});
await clientCertificateManager.initialize();
// The client itself says only that it has been disconnected.
let told = "";
const { emit } = Socket.prototype;
Socket.prototype.emit = function heard(event, data, ...more) {
  if (event === "data" && data.toString("latin1", 0, 3) === "ERR") {
    told = getStatusCodeFromCode(data.readUInt32LE(8)).name;
  }
  return emit.call(this, event, data, ...more);
};
const seen = {};
for (const file of readdirSync(folder).filter((one) => one.endsWith(".der")).sort()) {
  const name = file.slice(0, -4);
  const client = OPCUAClient.create({
    applicationUri, clientCertificateManager,
    certificateFile: join(folder, file), privateKeyFile: join(folder, `${name}.pem`),
    endpointMustExist: false, connectionStrategy: { maxRetry: 0 },
    securityMode: MessageSecurityMode.SignAndEncrypt, securityPolicy: SecurityPolicy.Aes128_Sha256_RsaOaep,
  });
  told = "";
  try {
    await client.connect(url);
    const session = await client.createSession({ type: UserTokenType.UserName, userName, password });
    await session.close();
    seen[name] = "Good";
  } catch (error) {
    seen[name] = told || (/Bad[A-Za-z]+/.exec(error.message)?.[0] ?? error.message);
  }
  await client.disconnect().catch(() => undefined);
}
console.log(JSON.stringify(seen));
