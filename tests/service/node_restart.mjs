/** Steps while the daemon at $MBCOSIM_ADDRESS is killed and comes back, as long as the file $MBCOSIM_KILL is there; prints the last step. */
import assert from "node:assert/strict";
import { existsSync, writeFileSync } from "node:fs";

import { connect, loadText } from "./mbcosim.mjs";

const body = `begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1.e-6; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, 1., 0., 0., null; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; end: elements;
`;

const server = connect(process.env.MBCOSIM_ADDRESS, { reconnect: Number(process.env.MBCOSIM_RECONNECT) });
const simulation = await loadText(server, body, { durability: "DURABILITY_JOURNAL" });
writeFileSync(process.env.MBCOSIM_KILL, "");
let taken = 0;
while (existsSync(process.env.MBCOSIM_KILL)) assert.equal((await simulation.step()).step, ++taken);
assert.equal((await simulation.step()).step, taken + 1);
assert.deepEqual(await simulation.read("step"), [taken + 1]);
await simulation.delete();
server.close();
