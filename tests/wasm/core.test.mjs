import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { config, loadCore, pointVolume, poses, scenesFile } from "./core.mjs";

const core = await loadCore();

function drill(count, each = () => {}) {
  const session = new core.Session(pointVolume().bytes, config);
  for (const pose of poses(count)) each(session, session.step(...pose), pose);
  return session;
}

const scenes = readFileSync(scenesFile, "utf8")
  .split("\n")
  .filter((line) => line && !line.startsWith("#") && !line.startsWith("bits"))
  .map((line) => line.split(","))
  .map(([scene, engine, discs, cycles, hash, removed]) => ({ scene, engine, discs: +discs, cycles: +cycles, hash, removed: +removed }));

test("there are golden scenes of all three kinds", () => {
  assert.deepEqual([...new Set(scenes.map((s) => s.scene))].sort(), ["hand", "off", "on"]);
});

for (const { scene, engine, discs, cycles, hash, removed } of scenes) {
  test(`scene ${scene} with engine ${engine} on ${discs} discs over ${cycles} cycles has its golden hash`, () => {
    assert.deepEqual(core.runScene(scene, engine, cycles, discs), { hash, removed, cycles });
  });
}

test("a scene without a number of cycles or discs runs whole", () => {
  const whole = scenes.find((s) => s.scene === "on" && s.discs === 378 && s.engine === "clearance");
  assert.equal(core.runScene("on", "", 0, 0).hash, whole.hash);
});

test("a session counts accepted poses, and refuses the others with a status", () => {
  let accepted = 0;
  let total = 0;
  const session = drill(300, (_, result, pose) => {
    const bad = Number.isNaN(pose[3]);
    accepted += bad ? 0 : 1;
    total += result.removed;
    assert.equal(result.status, bad ? 1 : 0);
    assert.equal(result.cycle, accepted);
    assert.equal(result.removed_total, total);
    if (!bad) assert.equal(result.depth_mm, pose[3]);
    assert.ok(result.thrust_N >= 0);
  });
  assert.ok(total > 1000);
  assert.equal(session.points(), pointVolume().points);
  assert.equal(session.pointsAlive(), pointVolume().points - total);
  assert.match(session.stateHash(), /^[0-9a-f]{16}$/);
  session.delete();
});

test("a recording of a session replays to the same hash, and stepping may go on after it was taken", () => {
  const session = drill(1234);
  const recording = session.recordingBytes();
  const hash = session.stateHash();
  assert.deepEqual(session.recordingBytes(), recording, "asking again gives the same bytes");
  const player = new core.Player(recording);
  assert.deepEqual(player.verify(), {
    verified: true,
    cycles: player.cycles(),
    hash,
    first_difference: 0,
    discs: [],
    comparable: true,
    finding: `verified: ${player.cycles()} cycles re-run, the same state`,
  });
  assert.equal(player.cycles(), poses(1234).filter((pose) => !Number.isNaN(pose[3])).length);
  const header = JSON.parse(player.headerJson());
  assert.equal(header.case_id, "c7k2m9xq");
  assert.equal(header.path_id, "p1");
  assert.equal(header.engine, "clearance");
  assert.equal(header.complete, true);
  assert.deepEqual(header.bit, { diameter_mm: 1.2, cone_length_mm: 0.8, length_mm: 10 });
  assert.deepEqual(header.lattice, { spacing_mm: 0.1, rings: 12, discs: 30, first_disc: -2 });
  session.step(2e6, 0, 0, 2.4, 0, 0, 1, true);
  assert.notEqual(session.stateHash(), hash);
  player.delete();
  session.delete();
});

test("a recording cut anywhere behind its volume still plays, and one with a flipped byte does not", () => {
  const session = drill(2100);
  const recording = session.recordingBytes();
  session.delete();
  const player = new core.Player(recording.slice(0, recording.length - 30));
  assert.equal(JSON.parse(player.headerJson()).complete, false);
  assert.equal(player.verify().verified, true);
  assert.ok(player.cycles() > 1900);
  player.delete();
  const flipped = recording.slice();
  flipped[flipped.length - 60] ^= 1; // in the last inputs, before two checksums and the end mark
  assert.throws(() => new core.Player(flipped), /^Error: recording: a chunk that does not match its checksum at byte \d+$/);
});

/** Lattice points as text keys, so that sets of splats can be compared. */
const keysOf = (floats) => {
  const keys = new Set();
  for (let i = 0; i < floats.length; i += 7) keys.add(`${floats[i]},${floats[i + 1]},${floats[i + 2]}`);
  assert.equal(keys.size, floats.length / 7);
  return keys;
};

test("a player at any cycle in any order draws what a client of the session draws after as many poses", () => {
  const drawn = new Map();
  const states = [];
  const session = drill(400, (live) => {
    const floats = live.takeSplats();
    const indices = live.takeSplatIndices();
    assert.equal(floats.length, 7 * indices.length);
    indices.forEach((index, i) => {
      assert.ok(!drawn.has(index));
      assert.ok(Math.abs(Math.hypot(...floats.slice(7 * i + 3, 7 * i + 6)) - 1) < 1e-6, "a unit normal");
      drawn.set(index, floats.slice(7 * i, 7 * i + 7));
    });
    for (const index of live.takeHidden()) assert.ok(drawn.delete(index), "hidden, so it was drawn");
    const all = new Float32Array(7 * drawn.size);
    [...drawn.values()].forEach((splat, i) => all.set(splat, 7 * i));
    states.push(keysOf(all));
  });
  const accepted = states.filter((_, i) => !Number.isNaN(poses(400)[i][3]));
  const player = new core.Player(session.recordingBytes());
  assert.equal(player.cycles(), accepted.length);
  for (const cycle of [400, 1, 200, 199, 201, 3, 384, 77, 350, 120]) {
    player.seek(cycle);
    assert.equal(player.cycle(), Math.min(cycle, player.cycles()));
    assert.deepEqual(keysOf(player.splats()), accepted[Math.min(cycle, player.cycles()) - 1], `cycle ${cycle}`);
  }
  player.seek(0);
  assert.equal(player.splats().length, 0, "a solid lattice has nothing to see before the first cut");
  player.delete();
  session.delete();
});

test("poses and series are those of the session", () => {
  const results = [];
  const session = drill(300, (_, result, pose) => result.status === 0 && results.push({ result, pose }));
  const player = new core.Player(session.recordingBytes());
  for (const cycle of [1, 2, 150, results.length]) {
    const { result, pose } = results[cycle - 1];
    const shown = player.poseAt(cycle);
    assert.equal(shown.t_us, pose[0]);
    assert.deepEqual(shown.tip, pose.slice(1, 4));
    assert.ok(Math.abs(Math.hypot(...shown.axis) - 1) < 1e-12);
    assert.equal(shown.thrust_N, result.thrust_N);
    assert.equal(shown.depth_mm, result.depth_mm);
    assert.equal(shown.removed_total, result.removed_total);
  }
  assert.equal(player.poseAt(0).removed_total, 0);
  const rows = player.series(100);
  assert.equal(rows.length, 4 * 4, "cycles 1, 101, 201 and the last");
  assert.equal(rows[0], 0);
  assert.equal(rows[13], Math.fround(results.at(-1).result.depth_mm));
  const point = (Math.PI / 3) * 0.001;
  assert.ok(Math.abs(rows[15] / (results.at(-1).result.removed_total * point) - 1) < 1e-6);
  player.delete();
  session.delete();
});

const countBits = (words) =>
  words.reduce((sum, word) => {
    let count = 0;
    for (let rest = word; rest !== 0; rest &= rest - 1) ++count;
    return sum + count;
  }, 0);

test("alive bits are those of the points that are left, live and at any cycle of a player", () => {
  const states = [];
  const session = drill(200, (live, result) => result.status === 0 && states.push(live.aliveBits()));
  assert.equal(countBits(states.at(-1)), session.pointsAlive());
  const player = new core.Player(session.recordingBytes());
  for (const cycle of [150, 3, states.length]) {
    player.seek(cycle);
    assert.deepEqual(player.aliveBits(), states[cycle - 1]);
  }
  player.delete();
  session.delete();
});

test("metrics come as one JSON object with units in the keys", () => {
  const session = drill(300);
  const metrics = JSON.parse(session.metricsJson());
  assert.equal(metrics.cycles, 288);
  assert.ok(Math.abs(metrics.depth_max_mm - 2.19) < 0.03);
  assert.ok(metrics.removed_mm3 > 0 && metrics.entry_error_mm < 0.15 && metrics.peak_thrust_N > 0);
  session.delete();
});

test("an empty recording has no pose and is not verified", () => {
  const session = new core.Session(pointVolume().bytes, "{}");
  const player = new core.Player(session.recordingBytes());
  assert.equal(player.cycles(), 0);
  assert.equal(player.poseAt(0), undefined);
  assert.equal(player.series(1).length, 0);
  assert.equal(player.verify().verified, false);
  player.delete();
  session.delete();
});

test("wrong input throws an Error of one line that says what was wrong", () => {
  const { bytes } = pointVolume();
  const wrong = [
    [() => core.runScene("slowly", "bounded", 1, 1), /scene.*on.*off.*hand/],
    [() => core.runScene("on", "steam", 1, 1), /steam/],
    [() => new core.Session(bytes.slice(0, 100), "{}"), /point volume/],
    [() => new core.Session([1, 2, 3], "{}"), /not a Uint8Array/],
    [() => new core.Session(bytes, "{"), /not JSON/],
    [() => new core.Session(bytes, "3"), /not a JSON object/],
    [() => new core.Session(bytes, '{"engine":7}'), /engine/],
    [() => new core.Session(bytes, '{"engine":"steam"}'), /steam/],
    [() => new core.Session(bytes, '{"bit":{"diameter_mm":"wide"}}'), /diameter_mm/],
    [() => new core.Session(bytes, '{"bit":{"diameter_mm":900}}'), /./],
    [() => new core.Player(new Uint8Array(50)), /magic/],
    [() => new core.Player(undefined), /not a Uint8Array/],
  ];
  for (const [action, message] of wrong) {
    assert.throws(action, (error) => {
      assert.ok(error instanceof Error, String(error));
      assert.match(error.message, message);
      assert.ok(!error.message.includes("\n"));
      return true;
    });
  }
});

test("ten thousand errors in a row neither eat the stack nor the heap", () => {
  const { bytes } = pointVolume({ discs: 60, rings: 25 });
  for (let i = 0; i < 10000; ++i) assert.throws(() => core.runScene("slowly", "bounded", 1, 1));
  for (let i = 0; i < 2000; ++i) assert.throws(() => new core.Session(bytes.subarray(0, bytes.length - 1), "{}"));
  assert.equal(core.runScene("on", "bounded", 400, 40).removed, 5908);
});
