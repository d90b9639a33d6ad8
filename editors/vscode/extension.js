// Starts `whippen lsp` and lets the editor talk to it. Everything else is the server's.

const fs = require("fs");
const path = require("path");
const { commands, window, workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

/** The command that is told, or the one in the extension, or that of the path. */
function server(extension, told) {
    const own = path.join(extension, "bin", "whippen");
    return told || (fs.existsSync(own) ? own : "whippen");
}

async function start(extension) {
    const settings = workspace.getConfiguration("whippen");
    const command = server(extension, settings.get("path", ""));
    const options = {
        initializationOptions: { board: settings.get("board", "") },
        documentSelector: [{ language: "whip" }],
        synchronize: { fileEvents: workspace.createFileSystemWatcher("**/*.whip") },
    };
    client = new LanguageClient("whippen", "Whippen", { command, args: ["lsp"] }, options);
    try {
        await client.start();
    } catch (error) {
        window.showErrorMessage(`Whippen: cannot start "${command} lsp": ${error.message ?? error}. Set whippen.path.`);
    }
}

async function stop() {
    await client?.stop();
    client = undefined;
}

exports.activate = async (context) => {
    const restart = async () => {
        await stop();
        await start(context.extensionPath);
    };
    context.subscriptions.push(commands.registerCommand("whippen.restart", restart));
    context.subscriptions.push(
        workspace.onDidChangeConfiguration((change) => {
            if (change.affectsConfiguration("whippen")) {
                restart();
            }
        }),
    );
    await start(context.extensionPath);
};

exports.deactivate = stop;
