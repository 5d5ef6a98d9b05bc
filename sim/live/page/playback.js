// The controls of a recording: play, pause, speed and the frame.
export class Playback {
  constructor(form, setting, send) {
    form.hidden = !setting.recorded;
    this.play = form.querySelector("#play");
    this.seek = form.querySelector("#seek");
    this.speed = form.querySelector("#speed");
    this.held = false;
    this.play.onclick = () => send(this.paused ? "play" : "pause", null);
    this.seek.oninput = () => { this.held = true; send("seek", Number(this.seek.value)); };
    this.seek.onchange = () => { this.held = false; };
    this.speed.onchange = () => send("speed", Number(this.speed.value));
    form.onsubmit = () => false;
  }

  show({ frame, frames, paused, speed }) {
    this.paused = paused;
    this.play.textContent = paused ? "Play" : "Pause";
    this.seek.max = frames - 1;
    if (!this.held) this.seek.value = frame;
    const option = [...this.speed.options].find(({ value }) => Number(value) === speed);
    if (option) this.speed.value = option.value;
  }
}
