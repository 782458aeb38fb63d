// Runs the script of a report page without a browser: `node page_check.js PAGE.html`.
//
// A document that is just enough for src/report/replay.js; every player is taken to several ticks.
// Prints, as JSON, what the script decoded, so that a test can compare it with the recording.
"use strict";
const fs = require("fs");
const vm = require("vm");

const page = fs.readFileSync(process.argv[2], "utf8");
const between = (text, from, to) => {
  const start = text.indexOf(from);
  if (start < 0) throw new Error(`no ${from} in the page`);
  const end = text.indexOf(to, start + from.length);
  if (end < 0) throw new Error(`${from} does not end`);
  return text.slice(start + from.length, end);
};

// Numbers that reach the canvas must be numbers.
let drawn = 0;
function pen() {
  const target = { createImageData: (width, height) => ({ data: new Uint8ClampedArray(4 * width * height), width, height }) };
  return new Proxy(target, {
    get: (object, name) => name === "measureText" ? (text) => ({ width: 6 * text.length }) : object[name] || ((...given) => {
      drawn += 1;
      for (const value of given) if (typeof value === "number" && !Number.isFinite(value)) throw new Error(`${String(name)}(${given})`);
    }),
    set: (object, name, value) => { object[name] = value; return true; },
  });
}

class Element {
  constructor(name) {
    Object.assign(this, { tagName: name.toUpperCase(), style: {}, children: [], handlers: {}, attributes: {}, hidden: false });
    this.context = name === "canvas" ? pen() : null;
  }
  append(child) { this.children.push(child); }
  replaceChildren(...children) { this.children = children; }
  setAttribute(name, value) { this.attributes[name] = value; }
  addEventListener(name, handler) { this.handlers[name] = handler; }
  getContext() { return this.context; }
  getBoundingClientRect() { return { left: 0, top: 0, width: 100, height: 100 }; }
  fire(name, event) { this.handlers[name](Object.assign({ preventDefault() {}, target: this }, event)); }
  find(wanted) { return this.children.flatMap((child) => [...(wanted(child) ? [child] : []), ...child.find(wanted)]); }
  get text() { return (this.textContent || "") + this.children.map((child) => child.text).join(" "); }
}

const sections = page.split('<section class="replay">').slice(1).map((text) => {
  const data = between(text, '<script type="application/json">', "</script>");
  const section = new Element("section");
  const parts = { script: { textContent: data }, ".player": new Element("div"), ".still": new Element("div") };
  section.querySelector = (selector) => parts[selector];
  return Object.assign(section, { parts });
});

const frames = [], handlers = {};
const document = new Element("document");
document.createElement = (name) => new Element(name);
document.querySelectorAll = () => sections;
const window = {
  devicePixelRatio: 2,
  getComputedStyle: () => ({ getPropertyValue: () => "" }),
  matchMedia: () => new Element("media"),
  requestAnimationFrame: (callback) => frames.push(callback),
  addEventListener: (name, handler) => { handlers[name] = handler; },
};
const script = between(page.slice(page.lastIndexOf("<script>")), "<script>", "</script>");
const given = { document, window, atob, Blob, DecompressionStream, Response, console };
vm.runInNewContext(script, given, { filename: "replay.js" });

function check({ players, coresOf, spikesOf }) {
  if (players.length !== sections.length) {
    throw new Error(sections.map(({ parts }) => parts[".player"].textContent).join("; "));
  }
  const said = players.map((player, index) => {
    const { ".player": root, ".still": still } = sections[index].parts;
    if (!still.hidden) throw new Error("the still picture stays");
    const last = player.last();
    for (const at of [0, 1, Math.floor(last / 2), last - 1, last]) player.go(at);
    sections[index].fire("pointerdown", {});
    document.fire("keydown", { key: "Home" });
    if (player.at !== 0) throw new Error(`Home leads to ${player.at}`);
    document.fire("keydown", { key: "ArrowRight", shiftKey: true });
    document.fire("keydown", { key: "ArrowLeft" });
    if (player.at !== Math.min(10, last) - 1) throw new Error(`arrows lead to ${player.at}`);
    document.fire("keydown", { key: " " });
    for (let now = 0; frames.length; now += 1000 / 60) frames.shift()(now);
    if (player.at !== last || player.playing) throw new Error(`played to ${player.at} of ${last}`);
    const [slider] = root.find((child) => child.tagName === "INPUT");
    slider.value = "2";
    slider.fire("input", {});
    root.find((child) => child.tagName === "SELECT").forEach((select) => select.fire("change", {}));
    for (const name of ["pointermove", "pointerdown"]) {
      for (const canvas of root.find((child) => child.handlers[name])) canvas.fire(name, { clientX: 5, clientY: 5 });
    }
    root.clientWidth = 342;
    handlers.resize();
    if (player.strip.width !== 342) throw new Error(`a narrow page has a strip of ${player.strip.width}`);
    player.go(2);
    const ticks = player.episode.ticks.map((tick) => ({
      frames: tick.frames,
      spikes: tick.spikes,
      places: spikesOf(player.replay, tick),
      cores: player.replay.chip ? coresOf(tick) : null,
    }));
    return { text: root.text, ticks };
  });
  if (drawn < 100) throw new Error(`only ${drawn} strokes`);
  console.log(JSON.stringify(said));
}

window.spikeloop.ready.then(() => check(window.spikeloop));
