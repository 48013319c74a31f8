// The force as sound: a soft tone that rises with the force on the hand. Runs in the audio thread.

class Hum extends AudioWorkletProcessor {
  static get parameterDescriptors() {
    return [{ name: "force", defaultValue: 0, minValue: 0, maxValue: 1 }];
  }

  constructor() {
    super();
    this.phase = 0;
    this.loud = 0;
  }

  process(_, [[out]], { force }) {
    if (!out) return true;
    const wanted = force[0];
    for (let n = 0; n < out.length; n += 1) {
      this.loud += (wanted - this.loud) * 0.002;
      this.phase += (90 + 170 * this.loud) / sampleRate;
      const turn = this.phase * 2 * Math.PI;
      out[n] = 0.28 * this.loud * (Math.sin(turn) + 0.35 * Math.sin(2 * turn) + 0.15 * Math.sin(3 * turn));
    }
    this.phase %= 1;
    return true;
  }
}

registerProcessor("hum", Hum);
