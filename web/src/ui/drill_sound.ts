// Plays what state/sound.ts says: two saws as the motor, filtered noise as the bone.
import { type SoundInput, soundOf } from "../state/sound";

/** Parameters glide this fast, so that nothing clicks. */
const kGlide_s = 0.03;
const kLoudness = 0.22;

export class DrillSound {
  private readonly context = new AudioContext();
  private readonly saws: OscillatorNode[];
  private readonly cutoff: BiquadFilterNode;
  private readonly whine: GainNode;
  private readonly band: BiquadFilterNode;
  private readonly grind: GainNode;
  private readonly master: GainNode;

  /** Only from a gesture: browsers start no sound by themselves. */
  constructor() {
    const { context } = this;
    this.master = gain(context, 0, context.destination);
    this.whine = gain(context, 0, this.master);
    this.cutoff = new BiquadFilterNode(context, { type: "lowpass", frequency: 900, Q: 0.8 });
    this.cutoff.connect(this.whine);
    // Slightly apart, so that they beat as gears do.
    this.saws = [0, 9].map((detune) => {
      const saw = new OscillatorNode(context, { type: "sawtooth", frequency: 1, detune });
      saw.connect(this.cutoff);
      saw.start();
      return saw;
    });
    this.grind = gain(context, 0, this.master);
    this.band = new BiquadFilterNode(context, { type: "bandpass", frequency: 1000, Q: 1.1 });
    this.band.connect(this.grind);
    const noise = new AudioBufferSourceNode(context, { buffer: noiseOf(context), loop: true });
    noise.connect(this.band);
    noise.start();
  }

  play(input: SoundInput): void {
    const sound = soundOf(input);
    for (const saw of this.saws) this.glide(saw.frequency, sound.pitch_Hz);
    this.glide(this.cutoff.frequency, sound.cutoff_Hz);
    this.glide(this.whine.gain, sound.whine);
    this.glide(this.band.frequency, sound.grind_Hz);
    this.glide(this.grind.gain, sound.grind);
    this.glide(this.master.gain, kLoudness);
  }

  hush(): void {
    this.glide(this.master.gain, 0);
  }

  close(): void {
    void this.context.close();
  }

  private glide(param: AudioParam, value: number): void {
    param.setTargetAtTime(value, this.context.currentTime, kGlide_s);
  }
}

function gain(context: AudioContext, value: number, into: AudioNode): GainNode {
  const node = new GainNode(context, { gain: value });
  node.connect(into);
  return node;
}

/** Two seconds of noise, and coarser steps in it: bone chips, it does not hiss. */
function noiseOf(context: AudioContext): AudioBuffer {
  const buffer = context.createBuffer(1, 2 * context.sampleRate, context.sampleRate);
  const samples = buffer.getChannelData(0);
  let chip = 1;
  for (let i = 0; i < samples.length; ++i) {
    if (i % 97 === 0) chip = 0.35 + 0.65 * Math.random();
    samples[i] = chip * (2 * Math.random() - 1);
  }
  return buffer;
}
