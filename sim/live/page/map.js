// The ground from above: fields of view, graph, cameras, estimates with their 2σ ellipses, the truth.
import { roundStep, sharp } from "./canvas.js";

export class GroundMap {
  constructor(canvas, story) {
    Object.assign(this, { canvas, story });
  }

  draw() {
    const { setting } = this.story;
    const drawing = sharp(this.canvas);
    Object.assign(this, drawing);
    const { low, high } = setting.ground.area_m;
    this.scale = Math.min(this.width / (high[0] - low[0]), this.height / (high[1] - low[1]));
    this.middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    this.views(setting.ground);
    this.graph(setting.ground);
    this.truthPath();
    this.estimates(setting);
    for (const [name, camera] of Object.entries(setting.ground.cameras)) this.camera(name, camera);
    this.scaleBar(setting.ground, high[0] - low[0]);
  }

  at([x, y]) {
    return [this.width / 2 + (x - this.middle[0]) * this.scale, this.height / 2 - (y - this.middle[1]) * this.scale];
  }

  line(points, { closed = false } = {}) {
    this.context.beginPath();
    for (const point of points) this.context.lineTo(...this.at(point));
    if (closed) this.context.closePath();
  }

  dot(point, radius, color) {
    this.context.beginPath();
    this.context.arc(...this.at(point), radius, 0, 2 * Math.PI);
    this.context.fillStyle = color;
    this.context.fill();
  }

  views(ground) {
    this.context.lineWidth = 1;
    for (const { view_m } of Object.values(ground.cameras)) {
      this.line(view_m, { closed: true });
      this.context.globalAlpha = 0.09;
      this.context.fillStyle = this.color("ink");
      this.context.fill();
      this.context.globalAlpha = 0.35;
      this.context.strokeStyle = this.color("muted");
      this.context.stroke();
    }
    this.context.globalAlpha = 1;
    this.context.fillStyle = this.color("muted");
    for (const corners of ground.occluders_m) {
      this.line(corners, { closed: true });
      this.context.fill();
    }
  }

  graph(ground) {
    for (const [a, b] of ground.edges) {
      const broken = [a, b].some((name) => this.isLost(name));
      this.context.strokeStyle = this.color(broken ? "lost" : "muted");
      this.context.lineWidth = 1.5;
      this.context.setLineDash(broken ? [2, 6] : [6, 3]);
      this.line([ground.cameras[a].position_m, ground.cameras[b].position_m]);
      this.context.stroke();
    }
    this.context.setLineDash([]);
  }

  isLost(name) {
    return ["lost", "failed"].includes(this.story.nodes.get(name)?.state);
  }

  truthPath() {
    const path = this.story.path.slice(0, this.story.frame + 1).filter(Boolean);
    this.context.strokeStyle = this.color("ink");
    this.context.lineWidth = 1;
    this.line(path);
    this.context.stroke();
  }

  estimates({ colors }) {
    const order = ["single", "cpf", "dcpf"];
    const all = [...this.story.estimates.values()].filter(({ node }) => !this.isLost(node));
    all.sort((a, b) => order.indexOf(a.estimator) - order.indexOf(b.estimator));
    for (const { estimator, position, ellipse } of all) {
      const color = colors[estimator];
      if (estimator !== "single") {
        this.context.strokeStyle = color;
        this.context.lineWidth = 1.25;
        this.line(ellipse, { closed: true });
        this.context.stroke();
      }
      this.dot(position, { single: 3, cpf: 6, dcpf: 4 }[estimator], color);
    }
    if (this.story.truth) this.dot(this.story.truth.position, 2, this.color("ink"));
  }

  // A triangle that opens in the direction of sight, and the name behind it.
  camera(name, { position_m, heading }) {
    const [x, y] = this.at(position_m);
    const [dx, dy] = [heading[0], -heading[1]];
    const color = this.color(this.isLost(name) ? "lost" : "ink");
    this.context.fillStyle = color;
    this.context.beginPath();
    this.context.moveTo(x, y);
    this.context.lineTo(x + 11 * (dx - 0.6 * dy), y + 11 * (dy + 0.6 * dx));
    this.context.lineTo(x + 11 * (dx + 0.6 * dy), y + 11 * (dy - 0.6 * dx));
    this.context.fill();
    this.context.font = "600 13px system-ui, sans-serif";
    const words = this.isLost(name) ? `${name} lost` : name;
    const half = this.context.measureText(words).width / 2;
    const place = Math.min(Math.max(x, half + 2), this.width - half - 2);
    this.context.textAlign = "center";
    this.context.fillText(words, place, Math.min(Math.max(y - Math.sign(dy || 1) * 15 + 4, 14), this.height - 6));
  }

  // In the lower corner that is farther from all cameras.
  scaleBar(ground, extent) {
    const length = roundStep(extent, 5);
    const bottom = this.height - 12;
    const corners = [12, this.width - 12 - length * this.scale];
    const room = (left) => Math.min(...Object.values(ground.cameras).map(({ position_m }) => {
      const [x, y] = this.at(position_m);
      return Math.hypot(x - left - 0.5 * length * this.scale, y - bottom);
    }));
    const left = room(corners[0]) >= room(corners[1]) ? corners[0] : corners[1];
    this.context.strokeStyle = this.context.fillStyle = this.color("ink");
    this.context.lineWidth = 2;
    this.context.beginPath();
    this.context.moveTo(left, bottom);
    this.context.lineTo(left + length * this.scale, bottom);
    this.context.stroke();
    this.context.font = "12px system-ui, sans-serif";
    this.context.textAlign = "left";
    this.context.fillText(`${length} m`, left, bottom - 6);
  }
}
