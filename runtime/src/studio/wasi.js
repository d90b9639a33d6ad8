// The command as a module: WASI preview 1 over files in memory. It runs in a worker, in a page or under node.
//
//   runCommand(module, { words, files, input }) -> { code, output, errors, files }
//
// Files are a Map from names (such as "piano.whip") to bytes; folders are what stands before a slash. Each call is a fresh instance, so
// nothing is left of the one before. What the module asks for beyond what stands here is refused as a system would (ENOSYS).

const ERRNO = { bad: 8, exists: 20, invalid: 28, isFolder: 31, absent: 44, unknown: 52, noFolder: 54, notEmpty: 55, unsupported: 58 };
const FILE_TYPE = { none: 0, folder: 3, file: 4 };
/** The folder that everything is in: the first descriptor behind the three streams. */
const ROOT = 3;
/** What a command that panics or traps ends with (`exit.rs`). */
const DEFECT = 3;

/** How a command ends. */
class Exit extends Error {
  constructor(code) {
    super(`exit ${code}`);
    this.code = code;
  }
}

/** Bytes that grow. */
class Bytes {
  constructor(bytes = new Uint8Array(0)) {
    [this.room, this.length] = [bytes, bytes.length];
  }

  /** The bytes themselves. */
  all() {
    return this.room.subarray(0, this.length);
  }

  resize(length) {
    if (length > this.room.length) {
      const room = new Uint8Array(Math.max(length, 2 * this.room.length, 256));
      room.set(this.all());
      this.room = room;
    } else {
      this.room.fill(0, length, Math.max(length, this.length));
    }
    this.length = length;
  }

  write(at, bytes) {
    if (at + bytes.length > this.length) this.resize(at + bytes.length);
    this.room.set(bytes, at);
  }
}

/** What one command sees of a system. */
class System {
  constructor({ words, files, input }) {
    const encoder = new TextEncoder();
    this.words = ["whippen", ...words].map((word) => encoder.encode(`${word}\0`));
    // What is given is copied where it is written, not before.
    this.files = new Map([...files].map(([name, bytes]) => [name, new Bytes(bytes)]));
    this.folders = new Set([""]);
    for (const name of files.keys()) this.addFolders(name);
    this.streams = [new Bytes(input), new Bytes(), new Bytes()];
    this.open = new Map([...this.streams.map((bytes, at) => [at, { bytes, at: 0, stream: true }]), [ROOT, { folder: "" }]]);
    this.next = ROOT + 1;
  }

  addFolders(name) {
    const parts = name.split("/");
    for (let count = 1; count < parts.length; count++) this.folders.add(parts.slice(0, count).join("/"));
  }

  get memory() {
    return new DataView(this.instance.exports.memory.buffer);
  }

  bytes(at, length) {
    return new Uint8Array(this.instance.exports.memory.buffer, at, length);
  }

  /** A name as files have it, or none where the descriptor is no folder. */
  name(fd, at, length) {
    const of = this.open.get(fd);
    if (of?.folder === undefined) return undefined;
    const parts = [];
    for (const part of `${of.folder}/${new TextDecoder().decode(this.bytes(at, length))}`.split("/")) {
      if (part === "..") parts.pop();
      else if (part !== "" && part !== ".") parts.push(part);
    }
    return parts.join("/");
  }

  /** The pieces of memory that a list names. */
  *pieces(at, count) {
    for (let n = 0; n < count; n++) {
      yield this.bytes(this.memory.getUint32(at + 8 * n, true), this.memory.getUint32(at + 8 * n + 4, true));
    }
  }

  putStat(at, type, size, number) {
    this.bytes(at, 64).fill(0);
    this.memory.setBigUint64(at + 8, BigInt(number), true);
    this.memory.setUint8(at + 16, type);
    this.memory.setBigUint64(at + 24, 1n, true);
    this.memory.setBigUint64(at + 32, BigInt(size), true);
    return 0;
  }

  /** A number of a name that is no other name's. */
  number(name) {
    let sum = 0n;
    for (const letter of new TextEncoder().encode(name)) sum = (sum * 1099511628211n + BigInt(letter) + 1n) & 0xffffffffffffn;
    return sum;
  }

  statOf(name, at) {
    const file = this.files.get(name);
    if (file) return this.putStat(at, FILE_TYPE.file, file.length, this.number(name));
    return this.folders.has(name) ? this.putStat(at, FILE_TYPE.folder, 0, this.number(name)) : ERRNO.absent;
  }

  /** The names in a folder, with what they are. */
  entries(folder) {
    const inside = folder === "" ? "" : `${folder}/`;
    const within = (name) => name !== folder && name.startsWith(inside) && !name.slice(inside.length).includes("/");
    const named = (names, type) => [...names].filter(within).map((name) => ({ name: name.slice(inside.length), type }));
    return [...named(this.files.keys(), FILE_TYPE.file), ...named(this.folders, FILE_TYPE.folder)];
  }

  read(file, from, at, count, told) {
    let [place, done] = [from, 0];
    for (const piece of this.pieces(at, count)) {
      const some = file.bytes.all().subarray(place, place + piece.length);
      piece.set(some);
      [place, done] = [place + some.length, done + some.length];
    }
    this.memory.setUint32(told, done, true);
    return done;
  }

  write(file, from, at, count, told) {
    let done = 0;
    for (const piece of this.pieces(at, count)) {
      file.bytes.write(from + done, piece);
      done += piece.length;
    }
    this.memory.setUint32(told, done, true);
    return done;
  }
}

/** Lists of words, as arguments and the environment are passed. */
function list(system, words) {
  const sizes = (count, bytes) => {
    system.memory.setUint32(count, words().length, true);
    system.memory.setUint32(bytes, words().reduce((sum, word) => sum + word.length, 0), true);
    return 0;
  };
  const get = (pointers, at) => {
    for (const word of words()) {
      system.memory.setUint32(pointers, at, true);
      system.bytes(at, word.length).set(word);
      [pointers, at] = [pointers + 4, at + word.length];
    }
    return 0;
  };
  return [sizes, get];
}

/** The calls about the process. */
function processCalls(system) {
  const [args_sizes_get, args_get] = list(system, () => system.words);
  const [environ_sizes_get, environ_get] = list(system, () => []);
  return {
    args_sizes_get,
    args_get,
    environ_sizes_get,
    environ_get,
    clock_time_get: (clock, _precision, at) => {
      const milliseconds = clock === 0 ? Date.now() : performance.now();
      system.memory.setBigUint64(at, BigInt(Math.round(milliseconds * 1e6)), true);
      return 0;
    },
    random_get: (at, length) => {
      for (let done = 0; done < length; done += 65536) crypto.getRandomValues(system.bytes(at + done, Math.min(65536, length - done)));
      return 0;
    },
    sched_yield: () => 0,
    proc_exit: (code) => {
      throw new Exit(code);
    },
  };
}

/** The calls about descriptors. */
function descriptorCalls(system) {
  const of = (fd, act) => {
    const found = system.open.get(fd);
    return found ? act(found) : ERRNO.bad;
  };
  const ofFile = (fd, act) => of(fd, (file) => (file.bytes ? act(file) ?? 0 : ERRNO.isFolder));
  return {
    fd_prestat_get: (fd, at) => {
      if (fd !== ROOT) return ERRNO.bad;
      system.memory.setUint32(at, 0, true);
      system.memory.setUint32(at + 4, 1, true);
      return 0;
    },
    fd_prestat_dir_name: (fd, at) => {
      if (fd !== ROOT) return ERRNO.bad;
      system.bytes(at, 1)[0] = "/".charCodeAt(0);
      return 0;
    },
    fd_fdstat_get: (fd, at) => of(fd, (file) => {
      system.bytes(at, 24).fill(0);
      system.memory.setUint8(at, file.stream ? FILE_TYPE.none : file.bytes ? FILE_TYPE.file : FILE_TYPE.folder);
      system.bytes(at + 8, 16).fill(0xff);
      return 0;
    }),
    fd_fdstat_set_flags: () => 0,
    fd_filestat_get: (fd, at) => of(fd, (file) => (file.stream ? system.putStat(at, FILE_TYPE.none, 0, fd) : system.statOf(file.name ?? file.folder, at))),
    fd_filestat_set_size: (fd, size) => ofFile(fd, (file) => file.bytes.resize(Number(size))),
    fd_filestat_set_times: () => 0,
    fd_read: (fd, at, count, told) => ofFile(fd, (file) => void (file.at += system.read(file, file.at, at, count, told))),
    fd_pread: (fd, at, count, from, told) => ofFile(fd, (file) => void system.read(file, Number(from), at, count, told)),
    fd_write: (fd, at, count, told) => ofFile(fd, (file) => void (file.at += system.write(file, file.at, at, count, told))),
    fd_pwrite: (fd, at, count, from, told) => ofFile(fd, (file) => void system.write(file, Number(from), at, count, told)),
    fd_seek: (fd, by, whence, told) => ofFile(fd, (file) => {
      const place = [0, file.at, file.bytes.length][whence] + Number(by);
      if (!(place >= 0)) return ERRNO.invalid;
      file.at = place;
      system.memory.setBigUint64(told, BigInt(place), true);
      return 0;
    }),
    fd_tell: (fd, told) => ofFile(fd, (file) => system.memory.setBigUint64(told, BigInt(file.at), true)),
    fd_sync: () => 0,
    fd_datasync: () => 0,
    fd_close: (fd) => of(fd, () => (system.open.delete(fd), 0)),
    fd_readdir: (fd, at, room, cookie, told) => of(fd, ({ folder }) => (folder === undefined ? ERRNO.noFolder : readFolder(system, folder, at, room, Number(cookie), told))),
  };
}

/** The entries of a folder from one on, as many as there is room for; the last may be cut. */
function readFolder(system, folder, at, room, from, told) {
  let done = 0;
  for (const [number, { name, type }] of system.entries(folder).entries()) {
    if (number < from || done >= room) continue;
    const text = new TextEncoder().encode(name);
    const record = new Uint8Array(24 + text.length);
    const view = new DataView(record.buffer);
    view.setBigUint64(0, BigInt(number + 1), true);
    view.setBigUint64(8, system.number(folder === "" ? name : `${folder}/${name}`), true);
    view.setUint32(16, text.length, true);
    view.setUint8(20, type);
    record.set(text, 24);
    const part = record.subarray(0, room - done);
    system.bytes(at + done, part.length).set(part);
    done += part.length;
  }
  system.memory.setUint32(told, done, true);
  return 0;
}

/** The calls about names. */
function pathCalls(system) {
  const { files, folders } = system;
  return {
    path_filestat_get: (fd, _flags, at, length, told) => system.statOf(system.name(fd, at, length), told),
    path_filestat_set_times: () => 0,
    path_readlink: (fd, at, length) => {
      const name = system.name(fd, at, length);
      return files.has(name) || folders.has(name) ? ERRNO.invalid : ERRNO.absent;
    },
    path_open: (fd, _follow, at, length, how, _rights, _inherited, _flags, told) => {
      const [create, wantsFolder, mustBeNew, empties] = [1, 2, 4, 8].map((bit) => (how & bit) !== 0);
      const name = system.name(fd, at, length);
      if (name === undefined) return ERRNO.bad;
      let file = files.get(name);
      if (folders.has(name)) {
        if (create) return mustBeNew ? ERRNO.exists : ERRNO.isFolder;
        system.open.set(system.next, { folder: name });
      } else {
        if (file && wantsFolder) return ERRNO.noFolder;
        if (file && create && mustBeNew) return ERRNO.exists;
        if (!file && !create) return ERRNO.absent;
        if (!folders.has(name.split("/").slice(0, -1).join("/"))) return ERRNO.absent;
        // What was given stays as it is: a file is written in bytes of its own.
        if (!file || empties) files.set(name, (file = new Bytes()));
        system.open.set(system.next, { name, bytes: file, at: 0 });
      }
      system.memory.setUint32(told, system.next++, true);
      return 0;
    },
    path_create_directory: (fd, at, length) => {
      const name = system.name(fd, at, length);
      if (files.has(name) || folders.has(name)) return ERRNO.exists;
      folders.add(name);
      return 0;
    },
    path_remove_directory: (fd, at, length) => {
      const name = system.name(fd, at, length);
      if (!folders.has(name)) return ERRNO.absent;
      if (system.entries(name).length > 0) return ERRNO.notEmpty;
      folders.delete(name);
      return 0;
    },
    path_unlink_file: (fd, at, length) => (files.delete(system.name(fd, at, length)) ? 0 : ERRNO.absent),
    path_rename: (fd, at, length, newFd, newAt, newLength) => {
      const [name, newName] = [system.name(fd, at, length), system.name(newFd, newAt, newLength)];
      const file = files.get(name);
      if (!file) return ERRNO.absent;
      if (folders.has(newName)) return ERRNO.isFolder;
      files.delete(name);
      files.set(newName, file);
      return 0;
    },
  };
}

/** What a newer libc than Debian's has itself: that there are no threads, and where the number of the last error stands (not here: 0). */
const LATER = { __errno_location: () => 0, pthread_create: () => ERRNO.unsupported };

/**
 * Runs the command once: `words` behind its name, `files` it finds, `input` it reads. `files` of the outcome are all that are there then,
 * `output` and `errors` are text. A panic ends with code 3.
 */
function runCommand(module, { words, files = new Map(), input = new Uint8Array(0) }) {
  const system = new System({ words, files, input });
  const calls = { ...processCalls(system), ...descriptorCalls(system), ...pathCalls(system) };
  const imports = WebAssembly.Module.imports(module);
  const given = (from, calls, other) => Object.fromEntries(imports.filter((of) => of.module === from).map(({ name }) => [name, calls[name] ?? other]));
  const ofSystem = given("wasi_snapshot_preview1", calls, () => ERRNO.unknown);
  system.instance = new WebAssembly.Instance(module, { wasi_snapshot_preview1: ofSystem, env: given("env", LATER, () => 0) });
  let code = 0;
  let broken = "";
  try {
    system.instance.exports._start();
  } catch (error) {
    if (!(error instanceof Exit)) broken = `${error}\n`;
    code = error instanceof Exit ? error.code : DEFECT;
  }
  const text = (at) => new TextDecoder().decode(system.streams[at].all());
  return { code, output: text(1), errors: text(2) + broken, files: new Map([...system.files].map(([name, bytes]) => [name, bytes.all()])) };
}
