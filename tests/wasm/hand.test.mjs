// The loop that the page's worker runs: a hand pushes, the bit meets bone, the bone pushes the hand back.
import assert from "node:assert/strict";
import { test } from "node:test";
import { loadCore, pointVolume } from "./core.mjs";

const core = await loadCore();

const stiffness = 5; // N/mm
const coupled = JSON.stringify({
  bit: { diameter_mm: 3, cone_length_mm: 2, length_mm: 60 },
  stiffness_N_mm: stiffness,
  speed_rpm: 1200,
  case_id: "c7k2m9xq",
  path_id: "p1",
});

/** Hard bone from 0 to 4 mm, cancellous bone to 10 mm, nothing behind. */
const layers = () => pointVolume({ spacing: 0.2, rings: 14, discs: 50, firstDisc: 0, density: (d) => (d < 20 ? 600 : 300) });

class Drill {
  constructor(volume = layers(), config = coupled) {
    this.session = new core.Session(volume.bytes, config);
    this.hand = new core.Hand(0.25, 0.1, 2);
    this.hand.place([0, 0, -0.5]);
    this.t_us = 0;
    this.reaction = [0, 0, 0];
    this.felt = null;
  }
  step(push_N, aim = [0, 0, 0], spinning = true) {
    this.hand.step(0.001, [0, 0, 1], push_N, aim, this.reaction);
    this.t_us += 1000;
    this.felt = this.session.step(this.t_us, ...this.hand.at(), 0, 0, 1, spinning);
    this.reaction = this.felt.hand_force_N;
    return this.felt;
  }
  /** Milliseconds until the tip is `depth` deep. */
  until(depth, push_N) {
    for (let ms = 1; ms <= 30000; ++ms) if (this.step(push_N).depth_mm >= depth) return ms;
    return Number.POSITIVE_INFINITY;
  }
  delete() {
    this.session.delete();
    this.hand.delete();
  }
}

test("a hand alone moves as its mass and damper say, and holds no spring along the drill", () => {
  const hand = new core.Hand(0.25, 0.1, 2);
  hand.place([1, 2, 3]);
  for (let i = 0; i < 200; ++i) hand.step(0.001, [0, 0, 1], 5, [1, 2, -40], [0, 0, 0]);
  // After 80 time constants of m / b = 2.5 ms: push / damping.
  assert.ok(Math.abs(hand.velocity()[2] - 50) < 1e-6);
  assert.deepEqual(hand.at().slice(0, 2), [1, 2]);
  for (let i = 0; i < 200; ++i) hand.step(0.001, [0, 0, 1], 0, [1, 2, -40], [0, 0, 0]);
  assert.ok(Math.abs(hand.velocity()[2]) < 1e-6, "let go, it stands");
  hand.delete();
});

test("across the drill the hand goes to its aim and stays there", () => {
  const hand = new core.Hand(0.25, 0.1, 2);
  hand.place([0, 0, 0]);
  const axis = [0.6, 0, 0.8];
  for (let i = 0; i < 2000; ++i) hand.step(0.001, axis, 0, [0.8 + 6, 1, -0.6 + 8], [0, 0, 0]);
  // The aim is (0.8, 1, -0.6), which is across the axis, and 10 mm along it that do not count.
  [0.8, 1, -0.6].forEach((want, i) => assert.ok(Math.abs(hand.at()[i] - want) < 1e-6));
  hand.delete();
});

test("the same push goes slowly through cortex, fast through cancellous bone, and plunges behind", () => {
  const drill = new Drill();
  drill.until(2.5, 20);
  const cortex = drill.until(3.5, 20);
  drill.until(7, 20);
  const cancellous = drill.until(8, 20);
  drill.until(12.5, 20); // the cone and the last of the bone are behind
  const air = drill.until(17.5, 20) / 5;
  assert.ok(cortex > 3 * cancellous, `${cortex} ms a mm in cortex, ${cancellous} in cancellous bone`);
  assert.ok(cancellous > 3 * air, `${cancellous} ms a mm in bone, ${air} behind it`);
  drill.delete();
});

test("in bone the force felt is the push, and the hand is ahead of the bit by what the coupling gives", () => {
  const drill = new Drill();
  drill.until(2.5, 20);
  let sum = 0;
  for (let i = 0; i < 100; ++i) sum += drill.step(20).thrust_N;
  // Steady but for the 0.1 N s/mm of damper at 3 mm/s, and the ripple of discs.
  assert.ok(Math.abs(sum / 100 - 20) < 0.7, String(sum / 100));
  const ahead = drill.hand.at()[2] - drill.felt.tip[2];
  assert.ok(Math.abs(ahead - drill.felt.thrust_N / stiffness) < 0.05, String(ahead));
  assert.equal(drill.felt.density_mg_cm3 === 0 || drill.felt.density_mg_cm3 === 600, true);
  assert.ok(drill.felt.torque_Nmm[2] < 0, "the bone holds the bit against its turning");
  drill.delete();
});

test("a bit that does not turn is stopped by bone, however hard the push", () => {
  const drill = new Drill();
  for (let i = 0; i < 1500; ++i) drill.step(30, [0, 0, 0], false);
  assert.ok(drill.felt.depth_mm < 0.3, String(drill.felt.depth_mm));
  assert.equal(drill.felt.removed_total, 0);
  assert.ok(Math.abs(drill.felt.thrust_N - 30) < 0.01);
  for (let i = 0; i < 1500; ++i) drill.step(0, [0, 0, 0], false);
  assert.ok(Math.abs(drill.felt.thrust_N) < 0.01, "let go, the spring has pushed the hand back");
  drill.delete();
});

test("the same pushes give the same drill to the last bit, and its recording replays to that hash", () => {
  const run = () => {
    const drill = new Drill();
    for (let i = 0; i < 2500; ++i) drill.step(10 + 8 * Math.sin(i / 90), [0.3 * Math.sin(i / 300), 0, 0]);
    return drill;
  };
  const [a, b] = [run(), run()];
  assert.equal(a.session.stateHash(), b.session.stateHash());
  const player = new core.Player(a.session.recordingBytes());
  const verdict = player.verify();
  assert.equal(verdict.verified, true);
  assert.equal(verdict.hash, a.session.stateHash());
  const header = JSON.parse(player.headerJson());
  assert.equal(header.stiffness_N_mm, stiffness);
  assert.equal(header.speed_rpm, 1200);
  assert.deepEqual(player.poseAt(2500).tip, a.felt.tip, "a replay shows where the bit was, not the hand");
  player.delete();
  a.delete();
  b.delete();
});

test("a session that is held rigidly stands where the hand is", () => {
  const drill = new Drill(layers(), JSON.stringify({ bit: { diameter_mm: 3, cone_length_mm: 2, length_mm: 60 } }));
  drill.session.step(0, 0, 0, -1, 0, 0, 1, true);
  const felt = drill.session.step(1000, 0.5, 0, 2, 0, 0, 2, true);
  assert.deepEqual([felt.tip, felt.axis], [[0.5, 0, 2], [0, 0, 1]]);
  drill.delete();
});

test("numbers that are no hand's give the usual hand", () => {
  for (const [mass, damping, across] of [[0, 0.1, 1], [Number.NaN, 0.1, 1], [0.25, -1, 1], [0.25, 0.1, Number.POSITIVE_INFINITY]]) {
    const hand = new core.Hand(mass, damping, across);
    hand.place([0, 0, 0]);
    for (let i = 0; i < 100; ++i) hand.step(0.001, [0, 0, 1], 1, [1, 0, 0], [0, 0, 0]);
    for (const v of hand.at()) assert.ok(Number.isFinite(v));
    hand.delete();
  }
});
