// Unpacks an extension as VS Code does, activates it with an editor that is not there, and asks the server that it starts
// for what it can do, over the library that lies in the extension.
//   node extension.cjs FILE.vsix FOLDER [COMMAND]      COMMAND: the setting whippen.path
const { spawn } = require("child_process");
const fs = require("fs");
const Module = require("module");
const path = require("path");
const zlib = require("zlib");

const [, , file, folder, told = ""] = process.argv;

/** The files of a ZIP archive with their rights, by its central directory. */
function unpack(bytes) {
    let at = bytes.lastIndexOf(Buffer.from("PK\x05\x06", "latin1"));
    const count = bytes.readUInt16LE(at + 10);
    at = bytes.readUInt32LE(at + 16);
    for (let n = 0; n < count; n++) {
        const [method, packed] = [bytes.readUInt16LE(at + 10), bytes.readUInt32LE(at + 20)];
        const [nameLength, extra, comment] = [28, 30, 32].map((offset) => bytes.readUInt16LE(at + offset));
        const [mode, local] = [bytes.readUInt32LE(at + 38) >>> 16, bytes.readUInt32LE(at + 42)];
        const name = bytes.toString("utf8", at + 46, at + 46 + nameLength);
        const start = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
        const data = bytes.subarray(start, start + packed);
        const to = path.join(folder, name);
        fs.mkdirSync(path.dirname(to), { recursive: true });
        fs.writeFileSync(to, method === 8 ? zlib.inflateRawSync(data) : data, { mode: mode & 0o777 || 0o644 });
        at += 46 + nameLength + extra + comment;
    }
}

unpack(fs.readFileSync(file));
const extension = path.join(folder, "extension");
const inside = Module.createRequire(path.join(extension, "extension.js"));
const manifest = inside("./package.json");
const wire = inside("vscode-jsonrpc/node");

/** What the extension makes of the library's client, as a real one starts it. */
class LanguageClient {
    constructor(id, name, server, options) {
        Object.assign(this, { server, options });
    }

    async start() {
        const { command, args } = this.server;
        const child = spawn(command, args, { stdio: ["pipe", "pipe", "inherit"] });
        await new Promise((started, failed) => child.on("spawn", started).on("error", failed));
        const connection = wire.createMessageConnection(new wire.StreamMessageReader(child.stdout), new wire.StreamMessageWriter(child.stdin));
        connection.listen();
        const { initializationOptions } = this.options;
        const answer = await connection.sendRequest("initialize", { processId: process.pid, capabilities: {}, initializationOptions });
        await connection.sendRequest("shutdown");
        await connection.sendNotification("exit");
        await new Promise((done) => child.on("exit", done));
        console.log(JSON.stringify({ command, answer }));
    }
}

const settings = { path: told };
const vscode = {
    commands: { registerCommand: () => ({}) },
    window: { showErrorMessage: (text) => console.log(JSON.stringify({ error: text })) },
    workspace: {
        getConfiguration: () => ({ get: (name, otherwise) => settings[name] || otherwise }),
        createFileSystemWatcher: () => ({}),
        onDidChangeConfiguration: () => ({}),
    },
};
const load = Module._load;
Module._load = (name, ...rest) => {
    if (name === "vscode") return vscode;
    if (name === "vscode-languageclient/node") {
        inside.resolve(name); // the real one must be there
        return { LanguageClient };
    }
    return load(name, ...rest);
};
inside(manifest.main).activate({ subscriptions: [], extensionPath: extension });
