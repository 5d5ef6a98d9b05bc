// Every camera's picture with its particles and the boxes of DCPF, CPF and the truth.
const COUNTED_MS = 3000;
const LINE_SHARE = 1 / 200; // of a picture's width
const HALO = "#ffffff";

export class Cameras {
  constructor(place, story) {
    this.story = story;
    this.views = new Map(story.setting.cameras.map((camera) => [camera.name, new View(camera)]));
    this.shown = []; // when pictures were drawn, milliseconds
    place.replaceChildren(...[...this.views.values()].map((view) => view.figure));
  }

  // A picture has come: decoded beside, drawn with the next screen refresh, the newest only.
  async show(event, blob) {
    const view = this.views.get(event.node);
    if (!view) return;
    const order = ++view.asked;
    const image = await createImageBitmap(blob).catch(() => null);
    if (!image || order <= view.got) return image?.close();
    view.got = order;
    view.image?.close();
    Object.assign(view, { image, event });
    this.shown.push(performance.now());
    view.figure.dataset.pictures = order;
  }

  draw() {
    for (const view of this.views.values()) {
      const lost = this.story.nodes.get(view.name)?.state === "lost";
      view.figure.classList.toggle("lost", lost);
      if (view.image && !(lost && view.drawn)) view.draw(this.story); // the last picture of a lost camera stays
    }
  }

  // Of each camera in the mean; null while there is none.
  picturesPerSecond() {
    const now = performance.now();
    this.shown = this.shown.filter((at) => now - at < COUNTED_MS);
    return this.shown.length ? this.shown.length / this.views.size / (COUNTED_MS / 1000) : null;
  }
}

class View {
  constructor({ name, width_px, height_px }) {
    Object.assign(this, { name, asked: 0, got: 0, image: null, event: null, drawn: false });
    this.figure = document.createElement("figure");
    this.canvas = document.createElement("canvas");
    Object.assign(this.canvas, { width: width_px, height: height_px, id: `camera-${name}` });
    this.caption = document.createElement("figcaption");
    const title = document.createElement("b");
    title.textContent = name;
    this.words = document.createElement("span");
    this.words.textContent = "no picture yet";
    this.caption.append(title, this.words);
    this.figure.append(this.canvas, this.caption);
  }

  draw(story) {
    const context = this.canvas.getContext("2d");
    const { colors, labels, central } = story.setting;
    const line = Math.max(2, Math.round(this.canvas.width * LINE_SHARE));
    context.drawImage(this.image, 0, 0, this.canvas.width, this.canvas.height);
    const frame = this.event.frame;
    this.box(context, boxOf(story, "truth", frame, this.name), colors.truth, line, [2 * line, 2 * line]);
    this.box(context, central && boxOf(story, `cpf/${central}`, frame, this.name), colors.cpf, line, []);
    const seen = this.box(context, boxOf(story, `dcpf/${this.name}`, frame, this.name), colors.dcpf, line, []);
    this.particles(context, line, colors.particles);
    this.drawn = true;
    this.words.textContent = seen ? `frame ${frame}` : `frame ${frame}, ${labels.dcpf} not in view`;
  }

  particles(context, line, color) {
    context.fillStyle = color;
    context.globalAlpha = 0.75;
    for (const [x, y] of this.event.particles) {
      context.beginPath();
      context.arc(x, y, line, 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  // Returns whether the box reaches into the picture.
  box(context, box, color, line, dash) {
    if (!box) return false;
    // Lines that cover whole pixels keep their colour.
    const [left, top, right, bottom] = box.map((edge) => Math.round(edge - line / 2) + line / 2);
    for (const [style, width, pattern] of [[HALO, line + 2, []], [color, line, dash]]) {
      Object.assign(context, { strokeStyle: style, lineWidth: width });
      context.setLineDash(pattern);
      context.strokeRect(left, top, right - left, bottom - top);
    }
    context.setLineDash([]);
    return right > 0 && bottom > 0 && left < this.canvas.width && top < this.canvas.height;
  }
}

// Of the picture's frame if it is known, or else the last before it.
function boxOf(story, track, frame, camera) {
  const before = [...(story.boxes.get(track) ?? [])].filter(([at]) => at <= frame);
  return before.length ? before.reduce((a, b) => (b[0] > a[0] ? b : a))[1][camera] : null;
}
