// SPDX-License-Identifier: GPL-3.0-or-later
// Runs firmware in rp2040js: node rp2040js_run.js PACKAGE job.json
// job: {bin, blocks: [bytes...], pins: [gpio...], end_us}; prints JSON with the
// bytes that came and the edges [ns, pin, level] at the pins.
'use strict';
const fs = require('fs');
const { Simulator } = require(process.argv[2]);
const job = JSON.parse(fs.readFileSync(process.argv[3]));
const { rp2040: chip, clock } = new Simulator();
const NS_PER_CYCLE = 8, BYTE_US = 40, PAUSE_US = 5000, BOOT_US = 60000;
const BOOT2 = 0x41f00, RAM = 0x20000000;
const bytes = [], edges = [];

// In place of the boot ROM: the second stage to the end of RAM
const image = fs.readFileSync(job.bin);
chip.loadBootrom(new Uint32Array(4096));
chip.flash.set(image);
chip.sram.set(image.subarray(0, 256), BOOT2);
chip.core.SP = RAM + BOOT2;
chip.core.LR = 0;
chip.core.PC = RAM + BOOT2;
chip.logger = { debug() {}, info() {}, warn() {}, error() {} };
chip.uart[0].onByte = (byte) => bytes.push(byte);
for (const pin of job.pins)
  chip.gpio[pin].addListener((state) => edges.push([clock.nanos, pin, state]));

function run(us) {
  const end = clock.nanos + us * 1000;
  while (clock.nanos < end) {
    if (chip.core.waiting)
      clock.tick(Math.max(1, Math.min(clock.nanosToNextAlarm, end - clock.nanos)));
    else
      clock.tick(chip.core.executeInstruction() * NS_PER_CYCLE);
  }
}

run(BOOT_US);
for (const block of job.blocks) {
  for (const byte of block) {
    chip.uart[0].feedByte(byte);
    run(BYTE_US);
  }
  run(PAUSE_US);
}
run(job.end_us - clock.nanos / 1000);
console.log(JSON.stringify({ bytes, edges }));
