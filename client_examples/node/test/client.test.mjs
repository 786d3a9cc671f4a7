/** Against the daemon at $MBCOSIM_ADDRESS. */
import assert from "node:assert/strict";
import { once } from "node:events";
import { createServer } from "node:net";
import { after, test } from "node:test";
import { fileURLToPath } from "node:url";

import { Simulation, call, connect, load, loadText, series } from "../mbcosim.mjs";

const server = connect(process.env.MBCOSIM_ADDRESS);
after(() => server.close());

const chain = (n) => `
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1.e-3; end: initial value;
begin: control data; structural nodes: ${n}; rigid bodies: ${n}; joints: ${n}; end: control data;
begin: nodes;
  for: integer k = 1, ${n}; structural: k, dynamic, real(k), 0., 0., eye, null, null; end for;
end: nodes;
begin: elements;
  for: integer k = 1, ${n}; body: k, k, 1., null, eye; end for;
  for: integer k = 1, ${n} - 1; joint: k, rod, k, k + 1, 1., linear elastic, 1.; end for;
  joint: ${n}, clamp, 1, node, node;
end: elements;
`;

const body = `set: real v = 1.;
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 0.25; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, v, 0., 0., null; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; end: elements;
`;

test("one call and one stream give the same steps", async () => {
  const simulation = await loadText(server, body, { symbols: { v: { number: 2 } } });
  const stepper = await simulation.stepper(["node.structural.1.X"]);
  const first = await stepper.step();
  assert.equal(first.outcome, "STEP_OUTCOME_ACCEPTED");
  assert.ok(Math.abs(first.outputs[0] - 0.5) < 1e-12);
  const second = await simulation.step(1, ["node.structural.1.X"]);
  assert.equal(second.step, 2);
  assert.ok(Math.abs(second.outputs[0] - 1) < 1e-12);
  assert.deepEqual(await simulation.read("node.structural.1.X"), second.outputs);
  stepper.close();
  await simulation.delete();
});

test("errors carry their code, reason and field", async () => {
  const refused = await loadText(server, "begin: nothing;").catch((error) => error);
  assert.equal(refused.code, 3);
  const details = refused.metadata.get("grpc-status-details-bin")[0].toString("latin1");
  assert.match(details, /DECK_ERROR/);
  assert.match(details, /mbcosim\.dev/);
  const gone = await call(server, server.simulations, "GetSimulation", { simulation: "simulations/none" }, 5).catch((error) => error);
  assert.equal(gone.code, 5);
});

test("what is no timeout, no number of steps and no choice is refused before it is sent", async () => {
  const simulation = await loadText(server, body);
  for (const timeout of [0, -1, NaN, Infinity])
    await assert.rejects(call(server, server.simulations, "GetSimulation", { simulation: simulation.name }, timeout), /^RangeError: timeout: must be/);
  const stepper = await simulation.stepper();
  for (const steps of [1.5, NaN, Infinity, "2"]) {
    await assert.rejects(simulation.step(steps), /^RangeError: steps: must be a whole number/);
    await assert.rejects(stepper.step(steps), /^RangeError: steps: must be a whole number/);
  }
  const refused = (choices, told) => assert.rejects(loadText(server, body, choices), told);
  await refused({ leese: { seconds: 5 } }, /^RangeError: CreateOptions: no field is called "leese"; choose from .*lease/);
  await refused({ durability: "journal" }, /^RangeError: durability: no choice is called "journal"; choose from .*DURABILITY_JOURNAL/);
  await refused({ ports: [{ name: "tip", kind: "structural" }] }, /^RangeError: kind: no choice is called "structural"; choose from .*PORT_KIND_STRUCTURAL/);
  await refused({ ports: [{ name: "tip", nodes: [1] }] }, /^RangeError: .*no field is called "nodes"; choose from .*node_labels/);
  assert.equal((await stepper.step()).step, 1);
  stepper.close();
  await simulation.delete();
});

test("what the server refuses has its field, and nothing is applied", async () => {
  const simulation = await loadText(server, body);
  for (const step_size of [NaN, Infinity, -1, 0, 1e-20]) {
    const refused = await call(server, server.simulations, "Step", { simulation: simulation.name, step_size }, 5).catch((error) => error);
    assert.equal(refused.code, 3);
    assert.match(refused.metadata.get("grpc-status-details-bin")[0].toString("latin1"), /google\.rpc\.BadRequest[^]*step_size/);
  }
  const { simulation: info } = await call(server, server.simulations, "GetSimulation", { simulation: simulation.name }, 5);
  assert.equal(info.step, 0);
  await simulation.delete();
});

test("units that are declared are named, and a peer counts in its own", async () => {
  const ports = [{ name: "tip", kind: "PORT_KIND_STRUCTURAL", node_labels: [1] }];
  const simulation = await loadText(server, body, { ports, units: { length: "mm", mass: "t", time: "s" } });
  const { model } = await call(server, server.simulations, "DescribeSimulation", { simulation: simulation.name }, 5);
  const load = model.variables.find(({ name }) => name === "node.structural.1.load");
  assert.deepEqual([load.unit, load.si_unit, model.units.inertia], ["N, N mm", "N, N m", "mass"]);
  const peer = server.coupling.Attach();
  const hello = { simulation: simulation.name, port: "tip", protocol: { lowest: 2, highest: 2 }, units: { length: "m", mass: "kg", time: "s" } };
  const exchanged = new Promise((resolve, reject) => {
    peer.on("error", reject);
    peer.on("data", ({ exchange }) => {
      if (!exchange) return;
      peer.write({ exchange: { index: exchange.index, answer: { forces: [1, 0, 0], moments: [0, 2, 0] } } });
      resolve(exchange.velocities[0]);
    });
  });
  await new Promise((resolve) => {
    peer.once("data", ({ welcome }) => resolve(assert.equal(welcome.layout.units.length, "m")));
    peer.write({ hello });
  });
  await simulation.step();
  assert.ok(Math.abs((await exchanged) - 1e-3) < 1e-15); // 1 mm/s
  assert.deepEqual(await simulation.read("node.structural.1.load"), [1, 0, 0, 0, 2000, 0]);
  peer.end();
  await simulation.delete();
});

test("a series that is left early ends its call", async () => {
  const simulation = await loadText(server, body), { telemetry } = server, subscribe = telemetry.Subscribe;
  let stream, ended;
  telemetry.Subscribe = Object.assign((...given) => (stream = subscribe.apply(telemetry, given)), subscribe);
  for await (const _ of series(server, telemetry, "Subscribe", { simulation: simulation.name })) {
    ended = new Promise((resolve) => stream.on("status", resolve));
    break;
  }
  delete telemetry.Subscribe;
  assert.equal((await ended).code, 1); // CANCELLED
  await simulation.delete();
});

test("a series that waits is cancelled from elsewhere, and its loop ends", async () => {
  const simulation = await loadText(server, body);
  const batches = series(server, server.telemetry, "Subscribe", { simulation: simulation.name });
  await batches.next(); // nothing more comes while nobody steps
  const waits = (async () => {
    for await (const _ of batches);
  })();
  batches.cancel();
  await waits;
  assert.deepEqual(await batches.next(), { done: true, value: undefined });
  await simulation.delete();
});

test("a series that is refused tells who asks for its messages, whenever that is", async () => {
  const simulation = await loadText(server, body);
  await simulation.delete();
  const messages = simulation.geometry();
  await new Promise((resolve) => setTimeout(resolve, 300));
  await assert.rejects(messages.next(), { code: 5 });
});

/** Does `work` with a connection to a server that accepts connections and says nothing. */
async function beforeSilence(work) {
  const visitors = [], silent = createServer((visitor) => visitors.push(visitor)).listen(0, "127.0.0.1");
  await once(silent, "listening");
  const other = connect(`127.0.0.1:${silent.address().port}`);
  await work(other);
  other.close();
  silent.close();
  for (const visitor of visitors) visitor.destroy();
}

test("a server that accepts connections and says nothing is not waited for, for ever", () =>
  beforeSilence(async (other) => {
    const batches = series(other, other.telemetry, "Subscribe", { simulation: "simulations/none" }), waits = batches.next();
    batches.cancel();
    assert.equal((await waits).done, true);
    await assert.rejects(loadText(other, body), /UNAVAILABLE: the server at .* accepts connections and does not answer/);
  }));

test("nothing goes out through a connection that is closed", async () => {
  const other = connect(process.env.MBCOSIM_ADDRESS, { reconnect: 600 }), closed = { code: 14, message: "14 UNAVAILABLE: the connection is closed" };
  const simulation = await loadText(other, body), stepper = await simulation.stepper();
  await stepper.step();
  other.close();
  for (const ask of [() => simulation.step(), () => simulation.stepper(), () => simulation.geometry().next(), () => loadText(other, body), () => stepper.step()])
    await assert.rejects(ask, closed, String(ask));
  stepper.close();
  await new Simulation(server, simulation.info).delete();
  await beforeSilence(async (silent) => {
    const waits = loadText(silent, body);
    setTimeout(silent.close, 100);
    await assert.rejects(waits, closed);
  });
});

test("every call takes a deadline as its last argument", async () => {
  await beforeSilence(async (other) => {
    const there = new Simulation(other, { name: "simulations/none" }), first = (messages) => messages.next();
    const calls = [
      (timeout) => call(other, other.simulations, "GetSimulation", { simulation: there.name }, timeout),
      (timeout) => first(series(other, other.telemetry, "Subscribe", { simulation: there.name }, timeout)),
      (timeout) => load(other, fileURLToPath(import.meta.url), {}, timeout),
      (timeout) => loadText(other, body, {}, timeout),
      (timeout) => there.handles(["step"], timeout),
      (timeout) => first(there.describe(timeout)),
      (timeout) => there.read("step", timeout),
      (timeout) => there.step(1, [], timeout),
      (timeout) => there.step(1, ["step"], timeout),
      (timeout) => there.stepper([], timeout),
      (timeout) => first(there.geometry({}, timeout)),
      (timeout) => first(there.linearize(timeout)),
      (timeout) => there.delete(timeout),
    ];
    for (const each of calls) {
      await assert.rejects(async () => each(-1), /^RangeError: timeout: must be/, String(each));
      await assert.rejects(each(0.1), { code: 4 }, String(each)); // DEADLINE_EXCEEDED
    }
  });
  const endless = body.replace("final time: 1.; time step: 0.25", "final time: 1.e6; time step: 1.e-6");
  const [one, other] = await Promise.all([loadText(server, endless), loadText(server, endless)]); // who gave up may find the first busy
  await assert.rejects(one.step(1e9, [], 0.5), { code: 4 });
  const stepper = await other.stepper([], 0.5);
  await assert.rejects(stepper.step(1e9), { code: 4 });
  await Promise.all([one.delete(), other.delete()]);
});

test("a model of 10 000 bodies passes the client's default limits", async () => {
  const n = 10_000;
  const simulation = await loadText(server, chain(n));
  let nodes = 0, elements = 0, drawn = 0, masses = 0;
  for await (const page of simulation.describe()) {
    nodes += page.nodes.length;
    elements += page.elements.length;
  }
  assert.deepEqual([nodes, elements], [n, 2 * n]);
  for await (const reply of simulation.geometry()) {
    if (reply.content === "nodes") drawn += reply.nodes.nodes.length;
    if (reply.content === "elements") for (const e of reply.elements.elements) masses += e.masses.length;
  }
  assert.deepEqual([drawn, masses], [n, n]);
  let unknowns = 0, entries = 0;
  for await (const page of simulation.linearize()) {
    unknowns += page.state_names.length;
    entries += (page.a?.values.length ?? 0) + (page.e?.values.length ?? 0);
    assert.ok(page.a === null || page.a.sparse);
  }
  assert.ok(unknowns >= 12 * n && entries > unknowns);
  const names = Array.from({ length: n }, (_, k) => ["X", "R", "XP", "Omega"].map((name) => `node.structural.${k + 1}.${name}`)).flat();
  const { step, outputs } = await simulation.step(1, names); // the reply that tells their handles has more than 4 MB
  assert.deepEqual([step, outputs.length], [1, 18 * n]);
  await simulation.delete();
});
