/** Follows a pendulum step by step. usage: node pendulum.mjs [ADDRESS] */
import { fileURLToPath } from "node:url";

import { connect, load } from "./mbcosim.mjs";

const X = "node.structural.2.X";
const server = connect(process.argv[2] ?? process.env.MBCOSIM_ADDRESS ?? `unix:${process.env.XDG_RUNTIME_DIR}/mbcosim.sock`);
const pendulum = await load(server, fileURLToPath(new URL("../models/pendulum.mbd", import.meta.url)));
const stepper = await pendulum.stepper([X]);
for (let k = 0; k < 5; ++k) {
  const { time, outputs } = await stepper.step(100);
  console.log(`${time.toFixed(3)} s: ${outputs.map((x) => x.toFixed(6)).join(" ")}`);
}
stepper.close();
await pendulum.delete();
server.close();
