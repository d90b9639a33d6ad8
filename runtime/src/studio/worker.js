// A worker that runs the command: one message, one command, in their order. Files that a command did not change are not sent back.

let compiler = null;

onmessage = ({ data }) => {
  if (data.module) {
    compiler = data.module;
    return;
  }
  const { number, words, files, input } = data;
  const given = new Map(Object.entries(files));
  const done = runCommand(compiler, { words, files: given, input: new TextEncoder().encode(input ?? "") });
  const isNew = ([name, bytes]) => {
    const before = given.get(name);
    return !before || before.length !== bytes.length || before.some((byte, at) => byte !== bytes[at]);
  };
  const written = [...done.files].filter(isNew).map(([name, bytes]) => [name, bytes.slice()]);
  postMessage({ number, ...done, files: Object.fromEntries(written) });
};
