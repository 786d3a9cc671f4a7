/**
 * A small client for mbcosim: the proto files of this repository are loaded at run time, nothing is generated.
 *
 *     const server = connect("unix:/run/user/1000/mbcosim.sock");
 *     const pendulum = await load(server, "pendulum.mbd");
 */
import { randomUUID } from "node:crypto";
import { readFile } from "node:fs/promises";
import { basename } from "node:path";
import { setTimeout as delay } from "node:timers/promises";
import { fileURLToPath } from "node:url";

import grpc from "@grpc/grpc-js";
import { loadSync } from "@grpc/proto-loader";

const PROTOS = process.env.MBCOSIM_PROTOS ?? fileURLToPath(new URL("../../proto", import.meta.url));
const PROTOCOL = { lowest: 2, highest: 2 };
const FILES = ["simulations", "telemetry", "geometry", "coupling"].map((name) => `mbcosim/v1/${name}.proto`);
const LONGEST = 1e9; // seconds of a timeout
const USUAL = 30; // seconds that a call may take which advances nothing
const CONNECTING = 10; // seconds until a server that accepts a connection has to say that it is one

// Ping after 10 s of silence, dead after 10 more: a server that is stopped is noticed.
const CHANNEL = {
  "grpc.keepalive_time_ms": 10_000,
  "grpc.keepalive_timeout_ms": 10_000,
  "grpc.keepalive_permit_without_calls": 1,
  "grpc.initial_reconnect_backoff_ms": 200,
  "grpc.max_reconnect_backoff_ms": 2_000,
  "grpc.max_receive_message_length": -1, // the server's own bound holds
};

const THIS_MACHINE = /^(localhost|127\.[\d.]+|\[::1\]):\d+$/;

/** Messages, enums and services of the contract; their descriptors are in `type`. */
const { v1 } = grpc.loadPackageDefinition(
  loadSync(FILES, { includeDirs: [PROTOS], keepCase: true, longs: Number, enums: String, defaults: true, oneofs: true }),
).mbcosim;

/**
 * A connection: stubs of the services. `token`: bearer token; `credentials`: grpc.credentials for TLS; `reconnect`: seconds for which the
 * calls of `load` and Simulation are made again when the server cannot be reached. Each is done once all the same. Streams end.
 */
export function connect(address, { token, credentials = grpc.credentials.createInsecure(), reconnect = 0 } = {}) {
  if (!(reconnect >= 0 && reconnect <= LONGEST)) throw new RangeError(`reconnect: must be a number of seconds from 0 to ${LONGEST}, got ${reconnect}`);
  const metadata = new grpc.Metadata();
  if (token) metadata.set("authorization", `Bearer ${token}`);
  // No proxy of the environment can stand between this machine and itself.
  const channel = THIS_MACHINE.test(address) ? { ...CHANNEL, "grpc.enable_http_proxy": 0 } : CHANNEL;
  const stub = (Service) => new Service(address, credentials, channel);
  const stubs = {
    simulations: stub(v1.Simulations),
    telemetry: stub(v1.Telemetry),
    geometry: stub(v1.Geometry),
    coupling: stub(v1.Coupling),
  };
  let closed = false;
  const close = () => {
    closed = true;
    Object.values(stubs).forEach((client) => client.close());
  };
  return { ...stubs, metadata, close, isClosed: () => closed, reconnect };
}

function options(timeout) {
  if (timeout === undefined) return {};
  if (timeout > 0 && timeout <= LONGEST) return { deadline: Date.now() + 1000 * timeout };
  throw new RangeError(`timeout: must be a positive number of seconds, at most ${LONGEST}, or undefined for no bound, got ${timeout}`);
}

/** Counts so many seconds down from now: tells what is left; undefined: no bound. */
function countdown(timeout) {
  const { deadline } = options(timeout);
  return () => deadline && Math.max((deadline - Date.now()) / 1000, 1e-3);
}

/** What grpc-js throws for a call that ends so. */
function failure(name, details) {
  const code = grpc.status[name];
  return Object.assign(new Error(`${code} ${name}: ${details}`), { code, details, metadata: new grpc.Metadata() });
}

/** To ask a closed channel for its state would open it again. */
function checkOpen(server) {
  if (server.isClosed()) throw failure("UNAVAILABLE", "the connection is closed");
}

/** Protobuf would make a whole number of anything. */
function whole(count, name) {
  if (Number.isSafeInteger(count)) return count;
  throw new RangeError(`${name}: must be a whole number, got ${count}`);
}

/** Protobuf would leave out fields and names of enums that it does not know. `type`: descriptor of the message. */
function checked(message, type) {
  for (const [name, value] of Object.entries(message)) {
    const field = type.field.find((field) => field.name === name);
    if (!field) throw new RangeError(`${type.name}: no field is called "${name}"; choose from ${type.field.map((field) => field.name).join(", ")}`);
    const definition = v1[field.typeName.split(".").pop()]?.type; // nothing: of Protobuf itself, a map's entry, a plain number or text
    for (const each of definition ? [value].flat() : []) {
      if (each === undefined || each === null) continue;
      if (field.type === "TYPE_MESSAGE") checked(each, definition);
      else if (!definition.value.some(({ name, number }) => name === each || number === each))
        throw new RangeError(`${name}: no choice is called ${JSON.stringify(each)}; choose from ${definition.value.map(({ name }) => name).join(", ")}`);
    }
  }
  return message;
}

/** Waits, not for ever, while a connection is made. grpc-js waits as long as a server accepts connections and says nothing. `deadline`: the call's. */
async function reach(server, client, { deadline = Infinity }) {
  const channel = client.getChannel(), patience = Date.now() + 1000 * CONNECTING, latest = Math.min(patience, deadline);
  const { IDLE, CONNECTING: underway } = grpc.connectivityState;
  for (;;) {
    checkOpen(server);
    const state = channel.getConnectivityState(true);
    if (![IDLE, underway].includes(state)) return;
    if (Date.now() >= latest) throw failure(latest < patience ? "DEADLINE_EXCEEDED" : "UNAVAILABLE", `the server at ${channel.getTarget()} accepts connections and does not answer`);
    await new Promise((resolve) => channel.watchConnectivityState(state, latest, () => resolve()));
  }
}

/** Who calls, and the simulation that it is about, by which a proxy finds the daemon that has it. */
export function about(server, simulation) {
  if (!simulation) return server.metadata;
  const metadata = server.metadata.clone();
  metadata.set("mbcosim-session", simulation);
  return metadata;
}

/** One message each way: the reply. `timeout`: seconds; undefined: as long as the server lives. */
export async function call(server, client, method, request, timeout) {
  const choices = options(timeout);
  checked(request, client[method].requestType.type);
  await reach(server, client, choices);
  return new Promise((resolve, reject) =>
    client[method](request, about(server, request.simulation), choices, (error, reply) => (error ? reject(error) : resolve(reply))),
  );
}

/** The same for a call of Simulations that may be repeated, as it changes nothing or has an id. The bound grows by `reconnect`. */
async function repeated(server, method, request, timeout) {
  options(timeout); // refuses what is none
  const left = countdown(timeout && Math.min(timeout + server.reconnect, LONGEST));
  let end;
  for (let pause = 50; ; pause = Math.min(2 * pause, 1000)) {
    try {
      return await call(server, server.simulations, method, request, left());
    } catch (error) {
      end ??= Date.now() + 1000 * server.reconnect;
      if (error.code !== grpc.status.UNAVAILABLE || server.isClosed() || Date.now() >= end) throw error;
      await delay(Math.min(pause, end - Date.now()));
    }
  }
}

/**
 * A series of messages, for `for await`, which begins the call when it asks for the first; who leaves that ends the call. `cancel()` does
 * so from elsewhere: a loop that waits ends. `timeout`: seconds for the whole series.
 */
export function series(server, client, method, request, timeout) {
  let stream, cancelled = false, wake;
  const waked = new Promise((resolve) => (wake = resolve));
  async function* messages() {
    const choices = options(timeout);
    checked(request, client[method].requestType.type);
    await Promise.race([waked, reach(server, client, choices)]);
    if (cancelled) return;
    stream = client[method](request, about(server, request.simulation), choices);
    stream.on("error", () => {}); // is thrown to who waits; nobody does when the series is left
    try {
      yield* stream;
    } catch (error) {
      if (!cancelled) throw error;
    } finally {
      stream.cancel();
    }
  }
  const cancel = () => {
    cancelled = true;
    wake();
    stream?.cancel();
  };
  return Object.assign(messages(), { cancel });
}

/** Creates a simulation from a deck without includes. `choices`: CreateOptions; `timeout`: seconds; undefined: as long as it takes. */
export async function load(server, deck, choices = {}, timeout) {
  const name = basename(deck);
  return create(server, { header: { bundle_main_file: name, options: { protocol: PROTOCOL, ...choices } }, files: [{ path: name, data: await readFile(deck) }] }, timeout);
}

/** Creates a simulation from a deck given as text. */
export async function loadText(server, text, choices = {}, timeout) {
  return create(server, { header: { bundle_main_file: "deck", options: { protocol: PROTOCOL, ...choices } }, files: [{ path: "deck", data: Buffer.from(text) }] }, timeout);
}

async function create(server, upload, timeout) {
  upload.header.options.request_id ??= randomUUID();
  const reply = await repeated(server, "CreateSimulationInline", upload, timeout);
  return new Simulation(server, reply.simulation);
}

/**
 * A simulation on the server. The last argument of its methods, `timeout`, bounds all that they do, in seconds; undefined: calls that advance
 * or go through the model take as long as they take, all others USUAL seconds.
 */
export class Simulation {
  #handles = new Map();

  constructor(server, info) {
    this.server = server;
    this.info = info;
    this.name = info.name;
  }

  #call(method, request, timeout = USUAL) {
    return repeated(this.server, method, request, timeout);
  }
  /** The same for calls that may take as long as they take. */
  #work(method, request, timeout) {
    return repeated(this.server, method, request, timeout);
  }

  /** Handles of variables by name; asks for those that are not known. */
  async handles(names, timeout) {
    const missing = names.filter((name) => !this.#handles.has(name));
    if (missing.length > 0) {
      const { model } = await this.#call("DescribeSimulation", { simulation: this.name, variable_names: missing }, timeout);
      for (const variable of model.variables) this.#handles.set(variable.name, variable.handle);
    }
    return names.map((name) => this.#handles.get(name));
  }

  /** Nodes, elements and variables, page by page. */
  async *describe(timeout) {
    for await (const page of this.#pages("DescribeSimulation", {}, timeout)) yield page.model;
  }

  async *#pages(method, request, timeout) {
    const left = countdown(timeout);
    let token = "";
    do {
      const page = await this.#work(method, { simulation: this.name, ...request, page_token: token }, left());
      yield page;
      token = page.next_page_token;
    } while (token);
  }

  /** Numbers of a variable at the last accepted step. */
  async read(name, timeout) {
    const left = countdown(timeout);
    return (await this.#call("ReadVariables", { simulation: this.name, handles: await this.handles([name], left()) }, left())).values;
  }

  /** Takes steps; StepReply. One that is not done in time is interrupted. */
  async step(steps = 1, outputs = [], timeout) {
    const left = countdown(timeout);
    const request = {
      simulation: this.name,
      steps: whole(steps, "steps"),
      outputs: await this.handles(outputs, left()),
      request_id: randomUUID(),
    };
    return this.#work("Step", request, left());
  }

  /** An open stream for stepping with the least delay: `await stepper.step()`, at last `stepper.close()`. `timeout` bounds the whole stream. */
  async stepper(outputs = [], timeout) {
    const choices = options(timeout);
    const handles = await this.handles(outputs, timeout);
    await reach(this.server, this.server.simulations, choices);
    return new Stepper(this.server, this.name, handles, choices);
  }

  /** What a viewer needs, message by message. */
  geometry(request = {}, timeout) {
    return series(this.server, this.server.geometry, "DescribeGeometry", { simulation: this.name, ...request }, timeout);
  }

  /** The descriptor form E ẏ = A y about the current state, page by page: sparse parts `e` and `a`, and `state_names`. */
  linearize(timeout) {
    return this.#pages("Linearize", { descriptor_form: true }, timeout);
  }

  /** Ends the simulation. */
  delete(timeout) {
    return this.#call("DeleteSimulation", { simulation: this.name, request_id: randomUUID() }, timeout);
  }
}

/** Steps on one open stream: one message each way per step. */
class Stepper {
  #waiting = [];
  #failure;

  constructor(server, simulation, outputs, choices) {
    this.server = server;
    this.request = { simulation, outputs };
    this.stream = server.simulations.StepStream(about(server, simulation), choices);
    this.stream.on("data", (reply) => this.#waiting.shift()?.resolve(reply.step));
    this.stream.on("error", (error) => this.#end(error));
    this.stream.on("end", () => this.#end(new Error("the server has ended the stream")));
  }

  #end(error) {
    this.#failure ??= error;
    for (const { reject } of this.#waiting.splice(0)) reject(this.#failure);
  }

  async step(steps = 1, inputs) {
    whole(steps, "steps");
    checkOpen(this.server);
    if (this.#failure) throw this.#failure;
    return new Promise((resolve, reject) => {
      this.#waiting.push({ resolve, reject });
      this.stream.write({ ...this.request, steps, inputs });
    });
  }

  close() {
    this.stream.end();
  }
}
