// The page's conductor: hears the feed, keeps what it says, and has everything drawn once a screen refresh.
import { Cameras } from "./cameras.js";
import { ErrorChart } from "./chart.js";
import { kilobytes } from "./format.js";
import { GroundMap } from "./map.js";
import { NodeTable } from "./nodes.js";
import { Playback } from "./playback.js";

const byId = (id) => document.getElementById(id);

// Everything that has been told, in one place; the parts of the page only read it.
const story = {
  setting: null,
  frame: 0,
  estimates: new Map(), // "dcpf/C1" -> the latest
  boxes: new Map(), // "dcpf/C1" -> frame -> boxes of the last frames
  errors: new Map(), // "dcpf/C1" -> frame -> metres, or pixels in the image plane
  truth: null,
  path: [], // frame -> [x, y]
  nodes: new Map(),
};
const BOXES_KEPT = 12;
let parts = [];
let cameras = null;
let playback = null;

function begin(setting) {
  Object.assign(story, { setting, path: [] });
  for (const kept of [story.estimates, story.boxes, story.errors, story.nodes]) kept.clear();
  document.title = `${setting.run} – dcpf`;
  byId("run").textContent = `${setting.run}, ${setting.preset} preset`;
  document.body.dataset.run = setting.run;
  cameras = new Cameras(byId("cameras"), story);
  playback = new Playback(byId("playback"), setting, send);
  parts = [cameras, new ErrorChart(byId("errors"), story), new NodeTable(byId("nodes"), story)];
  if (setting.ground) parts.push(new GroundMap(byId("map"), story));
  byId("map").parentElement.hidden = byId("map-note").hidden = !setting.ground;
  for (const place of document.querySelectorAll(".unit")) place.textContent = setting.unit;
  legend(setting);
}

function legend(setting) {
  const kinds = ["dcpf", setting.central && "cpf", setting.single && "single"].filter(Boolean);
  const items = kinds.map((kind) => [setting.colors[kind], setting.labels[kind]]);
  items.push(["var(--ink)", setting.labels.truth], [setting.colors.particles, "particles"]);
  byId("legend").replaceChildren(...items.map(([color, words]) => {
    const item = document.createElement("li");
    const dot = document.createElement("i");
    dot.style.background = color;
    item.append(dot, words);
    return item;
  }));
}

const tellers = {
  setting: begin,
  history(event) {
    for (const { estimator, node, errors } of event.errors) story.errors.set(`${estimator}/${node}`, new Map(errors));
    for (const [frame, x, y] of event.truth) story.path[frame] = [x, y];
  },
  estimate(event) {
    const track = `${event.estimator}/${event.node}`;
    story.estimates.set(track, event);
    keepBoxes(track, event);
    story.frame = event.frame;
  },
  truth(event) {
    story.truth = event;
    story.path[event.frame] = event.position.slice(0, 2);
    keepBoxes("truth", event);
  },
  error(event) {
    const track = `${event.estimator}/${event.node}`;
    if (!story.errors.has(track)) story.errors.set(track, new Map());
    story.errors.get(track).set(event.frame, event.error);
  },
  node(event) { story.nodes.set(event.node, event); },
  playback(event) { playback.show(event); },
};

function keepBoxes(track, event) {
  if (!story.boxes.has(track)) story.boxes.set(track, new Map());
  const kept = story.boxes.get(track);
  kept.delete(event.frame);
  kept.set(event.frame, event.boxes_px);
  if (kept.size > BOXES_KEPT) kept.delete(kept.keys().next().value);
}

function hear(data) {
  if (typeof data === "string") {
    for (const event of JSON.parse(data)) tellers[event.type]?.(event);
  } else if (cameras) {
    const length = new DataView(data).getUint32(0, true);
    const [event] = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    cameras.show(event, new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" }));
  }
  stale = true;
}

let stale = false;
function refresh() {
  if (stale && story.setting) {
    stale = false;
    for (const part of parts) part.draw();
    byId("frame").textContent = `${story.frame} of ${story.setting.frames - 1}`;
    document.body.dataset.frame = story.frame;
  }
  requestAnimationFrame(refresh);
}

function rates() {
  if (!cameras) return;
  const shown = cameras.picturesPerSecond();
  byId("pictures").textContent = shown === null ? "–" : shown.toFixed(1);
  document.body.dataset.picturesPerSecond = shown ?? "";
  for (const [kind, id] of [["consensus", "dcpf-rate"], ["pixels", "cpf-rate"]]) {
    const sent = [...story.nodes.values()].map((node) => node.bytes_per_s[kind]).filter((n) => n !== undefined);
    byId(id).textContent = sent.length ? kilobytes(sent.reduce((a, b) => a + b, 0)) : "–";
  }
}

let socket = null;
function send(order, value) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ order, value }));
}

function connection(words, state) {
  byId("connection").textContent = words;
  byId("connection").className = `chip ${state}`;
}

const GOING_AWAY = 1001; // how a server that ends in order closes
function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/feed`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => connection("● connected", "alive");
  socket.onmessage = ({ data }) => hear(data);
  socket.onclose = ({ code }) => {
    if (code === GOING_AWAY) return connection("the run has ended", "");
    connection("✕ connection lost, trying again", "lost");
    setTimeout(connect, 1000);
  };
}

document.addEventListener("visibilitychange", () => send("look", !document.hidden));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { stale = true; });
addEventListener("resize", () => { stale = true; });
setInterval(rates, 500);
requestAnimationFrame(refresh);
connect();
