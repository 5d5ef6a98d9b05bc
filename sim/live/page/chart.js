// The position error over time: DCPF in the mean over its nodes, and CPF.
import { roundStep, sharp } from "./canvas.js";

const [LEFT, RIGHT, TOP, BOTTOM] = [46, 12, 22, 36];

export class ErrorChart {
  constructor(canvas, story) {
    Object.assign(this, { canvas, story });
  }

  draw() {
    const { setting, frame } = this.story;
    Object.assign(this, sharp(this.canvas));
    const lines = ["cpf", "dcpf"].map((kind) => [kind, this.mean(kind)]).filter(([, line]) => line.length);
    const highest = Math.max(0.02, ...lines.flatMap(([, line]) => line.map(([, error]) => error)));
    const seconds = Math.max(1, setting.frames - 1) / setting.rate_hz;
    this.x = (at) => LEFT + (at / setting.rate_hz / seconds) * (this.width - LEFT - RIGHT);
    this.y = (error) => this.height - BOTTOM - (error / (1.05 * highest)) * (this.height - TOP - BOTTOM);
    this.axes(setting, 1.05 * highest, seconds);
    for (const [kind, line] of lines) {
      this.context.strokeStyle = setting.colors[kind];
      this.context.lineWidth = 2;
      this.context.beginPath();
      for (const [at, error] of line) this.context.lineTo(this.x(at), this.y(error));
      this.context.stroke();
    }
    this.vertical(frame);
    if (!lines.length) this.write("no truth is known yet", (LEFT + this.width) / 2, this.height / 2, "center");
  }

  // Frames in order with the mean error over the nodes of an estimator.
  mean(kind) {
    const sums = new Map();
    for (const [track, errors] of this.story.errors) {
      if (!track.startsWith(`${kind}/`)) continue;
      for (const [frame, error] of errors) {
        const [sum, n] = sums.get(frame) ?? [0, 0];
        sums.set(frame, [sum + error, n + 1]);
      }
    }
    return [...sums].map(([frame, [sum, n]]) => [frame, sum / n]).sort((a, b) => a[0] - b[0]);
  }

  axes(setting, highest, seconds) {
    const { context } = this;
    context.strokeStyle = this.color("faint");
    context.lineWidth = 1;
    const digits = (step) => Math.max(0, -Math.floor(Math.log10(step)));
    const up = roundStep(highest, 4);
    for (let error = 0; error <= highest; error += up) {
      context.beginPath();
      context.moveTo(LEFT, this.y(error));
      context.lineTo(this.width - RIGHT, this.y(error));
      context.stroke();
      this.write(error.toFixed(digits(up)), LEFT - 6, this.y(error) + 4, "right");
    }
    const along = roundStep(seconds, Math.max(2, this.width / 90));
    for (let time = 0; time <= seconds + 1e-9; time += along) {
      this.write(time.toFixed(digits(along)), this.x(time * setting.rate_hz), this.height - BOTTOM + 15, "center");
    }
    this.write(`error / ${setting.unit}`, 4, 13, "left");
    this.write("time / s", this.width - RIGHT, this.height - 5, "right");
  }

  vertical(frame) {
    this.context.strokeStyle = this.color("muted");
    this.context.lineWidth = 1;
    this.context.beginPath();
    this.context.moveTo(this.x(frame), TOP);
    this.context.lineTo(this.x(frame), this.height - BOTTOM);
    this.context.stroke();
  }

  write(words, x, y, align) {
    this.context.fillStyle = this.color("muted");
    this.context.textAlign = align;
    this.context.fillText(words, x, y);
  }
}
