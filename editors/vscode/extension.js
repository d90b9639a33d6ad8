// Starts `whippen lsp` and lets the editor talk to it. Everything else is the server's.

const { commands, window, workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

async function start() {
    const settings = workspace.getConfiguration("whippen");
    const command = settings.get("path", "whippen");
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

async function restart() {
    await stop();
    await start();
}

exports.activate = async (context) => {
    context.subscriptions.push(commands.registerCommand("whippen.restart", restart));
    context.subscriptions.push(
        workspace.onDidChangeConfiguration((change) => {
            if (change.affectsConfiguration("whippen")) {
                restart();
            }
        }),
    );
    await start();
};

exports.deactivate = stop;
