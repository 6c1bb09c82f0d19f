// SPDX-License-Identifier: GPL-3.0-or-later
// Runs a PIO program in rp2040js: node rp2040js_pio.js PACKAGE job.json
// job: {program, wrap: [to, from], start, rx, tx, levels: [level of each cycle],
// words}; a word follows each sample.  Prints JSON: samples [level...] and the edges
// [cycle, level] at the output.
'use strict';
const fs = require('fs');
const { Simulator } = require(process.argv[2]);
const job = JSON.parse(fs.readFileSync(process.argv[3]));
const { rp2040: chip } = new Simulator();
const pio = chip.pio[0], machine = pio.machines[0];
const samples = [], edges = [];
const SM0 = 0xc8, ENABLE = 1;

chip.logger = { debug() {}, info() {}, warn() {}, error() {} };
pio.run = () => {};         // steps are ours
job.program.forEach((word, i) => pio.writeUint32(0x48 + 4 * i, word));
pio.writeUint32(SM0 + 4, job.rx << 24 | job.wrap[1] << 12 | job.wrap[0] << 7);
pio.writeUint32(SM0 + 8, 1 << 19);
pio.writeUint32(SM0 + 20, 1 << 26 | 1 << 20 | job.rx << 15 | job.tx << 5 | job.tx);
pio.writeUint32(SM0 + 16, 0xe001);      // set pins, 1
pio.writeUint32(SM0 + 16, job.start);
chip.writeUint32(0x40014000 + 8 * job.rx + 4, 6);
chip.writeUint32(0x4001c000 + 4 + 4 * job.rx, 0x40);
pio.writeUint32(0x10, job.words.shift());
pio.writeUint32(0, ENABLE);
let level = 1;
const begin = machine.cycles;
while (job.words.length) {
  const cycle = machine.cycles - begin;
  if (cycle >= job.levels.length)
    break;
  chip.gpio[job.rx].setInputValue(job.levels[cycle] !== 0);
  machine.step();
  const now = pio.pinValues >>> job.tx & 1;
  if (now !== level)
    edges.push([cycle, level = now]);
  while (!machine.rxFIFO.empty) {
    samples.push(pio.readUint32(0x20));
    pio.writeUint32(0x10, job.words.shift());
  }
}
console.log(JSON.stringify({ samples, edges }));
