// The force beyond sight: sound, and rumble where there is a gamepad. Shows what the master sends; computes no force.

const RUMBLE_MS = 80;

export class Feedback {
  constructor() {
    this.context = null;
    this.rumbled = 0;
  }

  get sounds() {
    return this.context?.state === "running";
  }

  /** Sound on or off; a browser wants a person's gesture for it. */
  async toggle() {
    if (!this.context) {
      this.context = new AudioContext();
      await this.context.audioWorklet.addModule("hum.js");
      this.hum = new AudioWorkletNode(this.context, "hum", { numberOfInputs: 0 });
      this.hum.connect(this.context.destination);
    } else if (this.sounds) {
      await this.context.suspend();
      return false;
    }
    await this.context.resume();
    return true;
  }

  /** Takes in the force on the hand, N, of at most `most`. */
  feel(newtons, most, now) {
    const share = Math.min(newtons / most, 1);
    if (this.sounds) this.hum.parameters.get("force").value = share;
    if (share < 0.02 || now - this.rumbled < RUMBLE_MS / 2) return;
    this.rumbled = now;
    for (const pad of navigator.getGamepads?.() ?? []) {
      const effect = { duration: RUMBLE_MS, strongMagnitude: share, weakMagnitude: share / 2 };
      pad?.vibrationActuator?.playEffect?.("dual-rumble", effect)?.catch?.(() => {});
    }
  }
}
