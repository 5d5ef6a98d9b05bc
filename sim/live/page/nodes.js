// A row for every node: how it is, how well it knows, what it sends.
import { length, rate } from "./format.js";

const WORDS = { waiting: "○ waiting", alive: "● running", lost: "✕ lost", done: "✓ done", failed: "✕ left" };

export class NodeTable {
  constructor(body, story) {
    Object.assign(this, { body, story });
  }

  draw() {
    const { nodes, setting } = this.story;
    const order = [...setting.cameras.map(({ name }) => name), setting.central].filter((name) => nodes.has(name));
    while (this.body.rows.length > order.length) this.body.deleteRow(-1);
    order.forEach((name, index) => this.row(this.body.rows[index] ?? newRow(this.body), nodes.get(name), setting));
  }

  row(row, { node, state, since, returned, bytes_per_s }, { central }) {
    row.id = `node-${node}`;
    row.dataset.state = state;
    const [name, chip, error, alone, consensus, pixels] = row.cells;
    set(name, node);
    const badge = chip.firstChild;
    badge.className = `chip ${state}`;
    const when = returned ? `, back at ${since}` : state === "lost" ? ` at ${since}` : "";
    set(badge, WORDS[state] + when);
    set(error, length(this.latest(node === central ? `cpf/${node}` : `dcpf/${node}`)) + (node === central ? " (CPF)" : ""));
    set(alone, length(this.latest(`single/${node}`)));
    set(consensus, rate(bytes_per_s.consensus));
    set(pixels, rate(bytes_per_s.pixels));
  }

  // The error at the frame that is shown, or the last one before.
  latest(track) {
    const errors = this.story.errors.get(track);
    for (let frame = this.story.frame; errors && frame >= Math.max(0, this.story.frame - 3); frame--) {
      if (errors.has(frame)) return errors.get(frame);
    }
    return undefined;
  }
}

function newRow(body) {
  const row = body.insertRow();
  for (let i = 0; i < 6; i++) row.insertCell();
  row.cells[1].append(document.createElement("span"));
  return row;
}

function set(element, words) {
  if (element.textContent !== words) element.textContent = words;
}
