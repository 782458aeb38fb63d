// Plays recorded trials: arena, event frames, chip, spikes. Every `section.replay` holds the data
// as JSON (the form of src/report/replay.rs), a still picture, which stays where no script runs,
// and an empty player. No library, no network.
"use strict";

(function () {
  const SECTOR_DEG = 10, LEFTMOST_DEG = 85, LASER_M_MAX = 8, WINDOW_TICKS = 40;
  // Widths in page pixels: of a player, of its halves, between panels.
  const PLAYER_PX = 1136, HALF_PX = 560, GAP_PX = 16;
  const COLOURS = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#e69f00",
    "#44bb99", "#994455", "#997700", "#6699cc", "#bbbbbb"];
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
  const FONT = "11px system-ui, sans-serif";
  const layerColour = (layer) => COLOURS[layer % COLOURS.length];

  // ---- reading: the text of src/report/replay/codec.rs ----

  const COLUMNS = ["laser_mm", "goal_mm", "speed", "action", "layer_spikes", "dvs_state", "cores",
    "dynamic_fj", "time_ps"];

  async function inflated(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // LEB128: seven bits per byte, low ones first. Products, since a shift keeps 32 bits only.
  function numbersOf(bytes) {
    const numbers = [];
    let number = 0, unit = 1;
    for (const byte of bytes) {
      number += (byte & 127) * unit;
      unit *= 128;
      if (byte < 128) {
        numbers.push(number);
        number = 0;
        unit = 1;
      }
    }
    return numbers;
  }

  // Ticks of a trial: frames and spikes as rising places, all else as numbers.
  function ticksOf(numbers) {
    let at = 0;
    const next = () => numbers[at++];
    const several = (make) => Array.from({ length: next() }, make);
    const places = () => {
      let free = 0;
      return several(() => {
        const place = free + next();
        free = place + 1;
        return place;
      });
    };
    const ticks = several(() => ({}));
    for (const tick of ticks) tick.frames = several(places);
    let before = new Set();
    for (const tick of ticks) {
      const now = new Set(before);
      for (const place of places()) if (!now.delete(place)) now.add(place);
      tick.spikes = [...now].sort((a, b) => a - b);
      before = now;
    }
    for (const column of COLUMNS) {
      let last = [];
      for (const tick of ticks) {
        last = several((_, index) => {
          const written = next();
          return (last[index] || 0) + (written % 2 ? -(written + 1) / 2 : written / 2);
        });
        tick[column] = column === "goal_mm" ? last[0] : last;
      }
    }
    return ticks;
  }

  async function readReplay(text) {
    const replay = JSON.parse(text);
    for (const episode of replay.episodes) {
      episode.ticks = ticksOf(numbersOf(await inflated(episode.ticks)));
    }
    return replay;
  }

  // What every core did in a tick: synaptic operations, then spikes.
  function coresOf(tick) {
    const half = tick.cores.length / 2;
    return { operations: tick.cores.slice(0, half), spikes: tick.cores.slice(half) };
  }

  // [layer, step, row] of every kept spike of a tick.
  function spikesOf(replay, tick) {
    const kept = [];
    let bit = 0, row = 0;
    replay.layers.forEach((layer, index) => {
      if (layer.steps === 0) return;
      kept.push({ index, first: bit, row, neurons: layer.neurons });
      bit += layer.steps * layer.neurons;
      row += layer.neurons;
    });
    let at = 0;
    return tick.spikes.map((one) => {
      while (at + 1 < kept.length && one >= kept[at + 1].first) at++;
      const { index, first, row, neurons } = kept[at];
      return [index, Math.floor((one - first) / neurons), row + (one - first) % neurons];
    });
  }

  // ---- drawing ----

  function element(name, parent, properties) {
    const made = Object.assign(document.createElement(name), properties);
    parent.append(made);
    return made;
  }

  // A canvas of a size in page pixels, sharp on dense screens.
  function canvas(parent, width, height, label) {
    const figure = element("figure", parent, {});
    element("figcaption", figure, { textContent: label });
    const made = element("canvas", figure, {});
    const dense = window.devicePixelRatio || 1;
    made.width = Math.round(width * dense);
    made.height = Math.round(height * dense);
    made.style.width = width + "px";
    made.setAttribute("aria-label", label);
    made.setAttribute("role", "img");
    const pen = made.getContext("2d");
    pen.scale(dense, dense);
    return { canvas: made, pen, width, height };
  }

  // A canvas that is never shown, pixel by pixel.
  function sheet(width, height) {
    const made = document.createElement("canvas");
    made.width = Math.max(width, 1);
    made.height = Math.max(height, 1);
    return made;
  }

  function rgbOf(colour) {
    return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  }

  function disc(pen, x, y, radius, colour) {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
  }

  function line(pen, points, colour, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }

  function polygon(pen, points, colour) {
    pen.fillStyle = colour;
    pen.beginPath();
    points.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.closePath();
    pen.fill();
  }

  function drawArena(view, ink, replay, episode, at) {
    const { pen } = view, { arena } = replay, [x0, y0, x1, y1] = arena.bounds_m;
    const scale = view.width / Math.max(x1 - x0, y1 - y0, 1e-9);
    const place = (x, y) => [(x - x0) * scale, (y1 - y) * scale];
    const ofMm = ([x, y]) => place(x / 1000, y / 1000);
    pen.clearRect(0, 0, view.width, view.height);
    arena.polygons_m.forEach((corners) => polygon(pen, corners.map(([x, y]) => place(x, y)), ink.solid));
    arena.discs_m.forEach(([x, y, r]) => disc(pen, ...place(x, y), r * scale, ink.solid));
    arena.movers_m.forEach(([ax, ay, bx, by]) => line(pen, [place(ax, ay), place(bx, by)], ink.track, 1));
    disc(pen, ...ofMm(episode.pair_mm.slice(3)), replay.goal_radius_m * scale, ink.goal);
    episode.movers_mm[at].forEach((mover, index) =>
      disc(pen, ...ofMm(mover), arena.movers_m[index][4] * scale, ink.mover));
    const [x, y, yaw] = episode.poses_mm[at].map((milli) => milli / 1000);
    const tick = episode.ticks[at];
    (tick ? tick.laser_mm : []).forEach((mm, sector) => {
      const range = Math.min(mm / 1000, LASER_M_MAX);
      const corner = (side) => {
        const degrees = LEFTMOST_DEG - SECTOR_DEG * (sector - side / 2);
        const angle = yaw + degrees * Math.PI / 180;
        return place(x + range * Math.cos(angle), y + range * Math.sin(angle));
      };
      polygon(pen, [place(x, y), corner(1), corner(-1)], ink.laser);
    });
    line(pen, episode.poses_mm.map(ofMm), ink.ahead, 1);
    line(pen, episode.poses_mm.slice(0, at + 1).map(ofMm), ink.robot, 2.5);
    disc(pen, ...place(x, y), replay.robot_radius_m * scale, ink.robot);
    const nose = 2 * replay.robot_radius_m;
    line(pen, [place(x, y), place(x + nose * Math.cos(yaw), y + nose * Math.sin(yaw))], ink.robot, 3);
  }

  // Frames of a tick on each other, older ones fainter.
  function drawEvents(view, ink, replay, tick) {
    const { pen } = view, [columns, rows] = replay.frame_size;
    pen.clearRect(0, 0, view.width, view.height);
    if (!tick || tick.frames.length === 0) return;
    const small = sheet(columns, rows), paper = small.getContext("2d");
    const image = paper.createImageData(columns, rows), [r, g, b] = rgbOf(ink.event);
    tick.frames.forEach((frame, index) => {
      const age = tick.frames.length - 1 - index;
      for (const one of frame) {
        const pixel = 4 * (one % rows * columns + Math.floor(one / rows));
        image.data.set([r, g, b, 255 * Math.pow(0.62, age)], pixel);
      }
    });
    paper.putImageData(image, 0, 0);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(small, 0, 0, view.width, view.height);
  }

  // The DVS state: red above 0, blue below, full at two deviations.
  function drawState(view, tick) {
    const { pen } = view, state = tick ? tick.dvs_state : [];
    pen.clearRect(0, 0, view.width, view.height);
    const across = Math.ceil(Math.sqrt(state.length)) || 1, cell = view.width / across;
    state.forEach((hundredths, index) => {
      const strength = Math.min(Math.abs(hundredths) / 200, 1);
      pen.fillStyle = `rgba(${hundredths < 0 ? "59,120,216" : "214,73,51"},${strength.toFixed(2)})`;
      pen.fillRect(index % across * cell, Math.floor(index / across) * cell, cell - 1, cell - 1);
    });
  }

  // Where the cores lie, tile by tile, down each column of tiles.
  function corePlaces(plan, width) {
    const { tiles_x, tiles_y, cores_per_tile } = plan.mesh;
    const across = Math.ceil(Math.sqrt(cores_per_tile)), down = Math.ceil(cores_per_tile / across);
    const side = width / (tiles_x * (across + 0.3));
    const places = [];
    for (let core = 0; core < plan.cores.limit; core++) {
      const tile = Math.floor(core / cores_per_tile), within = core % cores_per_tile;
      const x = Math.floor(tile / tiles_y) * (across + 0.3) + within % across;
      const y = tile % tiles_y * (down + 0.3) + Math.floor(within / across);
      places.push([x * side, y * side]);
    }
    return { places, side, height: tiles_y * (down + 0.3) * side };
  }

  function drawChip(view, ink, plan, layout, counts, most) {
    const { pen } = view, scale = (n) => Math.sqrt(n / Math.max(most, 1));
    pen.clearRect(0, 0, view.width, view.height);
    layout.places.forEach(([x, y], core) => {
      const used = core < plan.utilization.length;
      const layer = used ? plan.layer_of_core[core] : null;
      pen.globalAlpha = used ? 0.12 + 0.88 * scale(counts[core] || 0) : 1;
      pen.fillStyle = used ? (layer === null ? ink.text : layerColour(layer)) : ink.empty;
      pen.fillRect(x + 1, y + 1, layout.side - 2, layout.side - 2);
    });
    pen.globalAlpha = 1;
  }

  // Spikes of a whole trial on a sheet, a pixel for each step and neuron, filled tick by tick.
  class Raster {
    constructor(replay, episode) {
      const kept = replay.layers.filter((layer) => layer.steps > 0);
      this.steps = Math.max(0, ...kept.map((layer) => layer.steps));
      this.rows = kept.reduce((sum, layer) => sum + layer.neurons, 0);
      this.replay = replay;
      this.episode = episode;
      this.sheet = sheet(this.steps * episode.ticks.length, this.rows);
      this.done = new Set();
    }

    fill(at) {
      const tick = this.episode.ticks[at];
      if (!tick || this.done.has(at) || this.rows === 0) return;
      this.done.add(at);
      const pen = this.sheet.getContext("2d");
      const image = pen.createImageData(this.steps, this.rows);
      for (const [layer, step, row] of spikesOf(this.replay, tick)) {
        image.data.set([...rgbOf(layerColour(layer)), 255], 4 * (row * this.steps + step));
      }
      pen.putImageData(image, this.steps * at, 0);
    }

    draw(view, ink, at) {
      const { pen } = view, left = 84, width = view.width - left;
      pen.clearRect(0, 0, view.width, view.height);
      if (this.rows === 0) return;
      const first = Math.max(0, at - WINDOW_TICKS + 1);
      for (let tick = first; tick <= at; tick++) this.fill(tick);
      const shown = Math.min(at, this.episode.ticks.length - 1) - first + 1;
      if (shown > 0) {
        pen.imageSmoothingEnabled = true;
        pen.drawImage(this.sheet, this.steps * first, 0, this.steps * shown, this.rows,
          left, 0, width * shown / WINDOW_TICKS, view.height);
      }
      let above = 0, free = 10; // names of small layers are pushed apart
      pen.font = FONT;
      this.replay.layers.forEach((layer, index) => {
        if (layer.steps === 0) return;
        const y = Math.max(view.height * (above + layer.neurons / 2) / this.rows + 4, free);
        free = y + 11;
        pen.fillStyle = layerColour(index);
        pen.fillRect(4, Math.min(y, view.height - 3) - 7, 7, 7);
        pen.fillStyle = ink.text;
        pen.fillText(layer.name, 15, Math.min(y, view.height - 3));
        above += layer.neurons;
      });
    }
  }

  // Goal distance, energy of each tick and spikes over the whole trial, each by its own maximum,
  // above an axis of seconds.
  function drawStrip(view, ink, replay, episode, at) {
    const { pen } = view, ticks = episode.ticks, n = Math.max(ticks.length, 1);
    pen.clearRect(0, 0, view.width, view.height);
    const energy = ticks.map((tick, index) =>
      (tick.dynamic_fj[0] || 0) - (index ? ticks[index - 1].dynamic_fj[0] || 0 : 0));
    const spikes = ticks.map((tick) => tick.layer_spikes.reduce((sum, count) => sum + count, 0));
    const curves = [
      ["distance to the goal", ticks.map((tick) => tick.goal_mm), ink.goalLine, (n) => (n / 1000).toFixed(1) + " m"],
      ["energy per tick", energy, ink.energy, (n) => (n / 1e9).toFixed(1) + " uJ"],
      ["spikes per tick", spikes, ink.robot, (n) => n.toLocaleString("en")],
    ];
    pen.font = FONT;
    // The legend takes as many lines as it needs.
    let x = 6, y = 13;
    const shown = curves.filter(([, values]) => Math.max(...values, 0) > 0);
    for (const [name, values, colour, said] of shown) {
      const text = `${name}, up to ${said(Math.max(...values))}`, wide = pen.measureText(text).width;
      if (x > 6 && x + 14 + wide > view.width) [x, y] = [6, y + 15];
      pen.fillStyle = colour;
      pen.fillRect(x, y - 8, 9, 9);
      pen.fillStyle = ink.text;
      pen.fillText(text, x + 14, y);
      x += wide + 34;
    }
    const top = y + 9, bottom = view.height - 18;
    for (const [, values, colour] of shown) {
      const most = Math.max(...values);
      line(pen, values.map((value, tick) =>
        [(tick + 0.5) / n * view.width, bottom - value / most * (bottom - top)]), colour, 1.3);
    }
    line(pen, [[0, bottom], [view.width, bottom]], ink.ahead, 1);
    const hz = replay.settings.control_hz, seconds = n / hz;
    const every = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500].find((s) => s / seconds * view.width > 60) || 1000;
    pen.fillStyle = ink.text;
    for (let second = 0; second <= seconds; second += every) {
      const x = second / seconds * view.width, text = second + " s";
      line(pen, [[x, bottom], [x, bottom + 4]], ink.ahead, 1);
      pen.fillText(text, Math.min(x + 3, view.width - pen.measureText(text).width), view.height - 4);
    }
    const now = (Math.min(at, n - 1) + 0.5) / n * view.width;
    line(pen, [[now, top - 4], [now, bottom]], ink.text, 1);
  }

  // ---- one player ----

  class Player {
    constructor(section, replay) {
      this.replay = replay;
      this.root = section.querySelector(".player");
      this.at = 0;
      this.speed = 1;
      this.playing = false;
      this.counted = "operations";
      this.build();
      this.choose(0);
      section.querySelector(".still").hidden = true;
    }

    // As wide as the page lets it be, so that writing in pictures keeps its size.
    build() {
      const { replay, root } = this, [x0, y0, x1, y1] = replay.arena.bounds_m;
      this.room = Math.min(root.clientWidth || PLAYER_PX, PLAYER_PX);
      const side = Math.min(HALF_PX, this.room), seconds = WINDOW_TICKS / replay.settings.control_hz;
      const tall = side * (y1 - y0) / Math.max(x1 - x0, y1 - y0, 1e-9);
      root.replaceChildren();
      this.controls();
      const panels = element("div", root, { className: "panels" });
      this.arena = canvas(panels, side, Math.max(tall, 1), "arena from above, laser in green, goal in red");
      const right = element("div", panels, { className: "column" });
      const top = element("div", right, { className: "panels" });
      this.events = canvas(top, 256, 256, "event camera, frames of this tick");
      const about = element("div", top, {});
      this.state = canvas(about, 120, 120, "DVS state, red above 0");
      this.readout = element("dl", about, { className: "readout" });
      if (replay.chip) {
        this.layout = corePlaces(replay.chip, side);
        this.chip = canvas(right, side, this.layout.height, "cores of the chip, by layer, glowing with activity");
        this.about = element("p", right, { className: "about", textContent: "point at a core" });
        for (const name of ["pointermove", "pointerdown"]) {
          this.chip.canvas.addEventListener(name, (event) => this.point(event));
        }
      }
      this.spikes = canvas(root, this.room, 280, `spikes, the last ${WINDOW_TICKS} ticks (${seconds} s)`);
      element("p", root, { className: "about", textContent: "spikes of this tick by layer, bars up to the most of this trial" });
      this.layers = element("div", root, { className: "layers" });
      this.bars = replay.layers.map((layer, index) => {
        const row = element("div", this.layers, {});
        element("span", row, { textContent: layer.name });
        const bar = element("i", row, {});
        bar.style.background = layerColour(index);
        return { bar, number: element("b", row, {}) };
      });
      this.strip = canvas(root, this.room, 128, "the whole trial; click to go there");
      this.strip.canvas.addEventListener("pointerdown", (event) => {
        const box = this.strip.canvas.getBoundingClientRect();
        this.go(Math.floor((event.clientX - box.left) / box.width * this.last()));
      });
    }

    // After the page has become wider or narrower.
    fit() {
      const room = Math.min(this.root.clientWidth || PLAYER_PX, PLAYER_PX);
      if (room === this.room) return;
      const { at, playing } = this;
      this.build();
      this.choose(this.chosen, at);
      this.button.textContent = playing ? "pause" : "play";
    }

    controls() {
      const bar = element("div", this.root, { className: "controls" });
      this.button = element("button", bar, { type: "button", textContent: "play" });
      this.button.addEventListener("click", () => this.toggle());
      this.slider = element("input", bar, { type: "range", min: 0, value: 0 });
      this.slider.setAttribute("aria-label", "tick");
      this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
      this.option(bar, "speed", SPEEDS.map((speed) => [speed, speed + " x"]), this.speed, (value) => {
        this.speed = Number(value);
      });
      const trials = this.replay.episodes.map((e, index) => [index, `trial ${e.trial}: ${e.outcome}`]);
      if (trials.length > 1) this.option(bar, "trial", trials, this.chosen || 0, (value) => this.choose(Number(value)));
      if (this.replay.chip) {
        const kinds = [["operations", "synaptic operations"], ["spikes", "spikes"]];
        this.option(bar, "cores glow with", kinds, this.counted, (value) => {
          this.counted = value;
          this.draw();
        });
      }
      element("small", bar, { textContent: "space, arrows, shift + arrows, home, end" });
    }

    option(parent, label, choices, chosen, changed) {
      const select = element("select", element("label", parent, { textContent: label + " " }), {});
      choices.forEach(([value, text]) => element("option", select, { value, textContent: text }));
      select.value = String(chosen);
      select.addEventListener("change", () => changed(select.value));
    }

    choose(index, at = 0) {
      this.chosen = index;
      this.episode = this.replay.episodes[index];
      this.raster = new Raster(this.replay, this.episode);
      this.slider.max = this.last();
      const ticks = this.episode.ticks, cores = this.replay.chip ? ticks.map(coresOf) : [];
      const most = (kind) => cores.reduce((sum, core) => Math.max(sum, ...core[kind]), 1);
      this.most = { operations: most("operations"), spikes: most("spikes") };
      this.mostOfLayer = this.replay.layers.map((_, layer) =>
        ticks.reduce((sum, tick) => Math.max(sum, tick.layer_spikes[layer]), 1));
      this.go(at);
    }

    last() {
      return this.episode.poses_mm.length - 1;
    }

    go(at) {
      this.at = Math.min(Math.max(Math.floor(at), 0), this.last());
      this.slider.value = this.at;
      this.draw();
    }

    toggle() {
      this.playing = !this.playing;
      this.button.textContent = this.playing ? "pause" : "play";
      if (!this.playing) return;
      if (this.at === this.last()) this.go(0);
      let then = null, passed = this.at;
      const step = (now) => {
        if (!this.playing) return;
        if (passed < this.at || passed >= this.at + 1) passed = this.at;
        passed += then === null ? 0 : (now - then) / 1000 * this.speed * this.replay.settings.control_hz;
        then = now;
        if (Math.floor(passed) !== this.at) this.go(passed);
        if (this.at === this.last()) return this.toggle();
        passed = Math.max(this.at, Math.min(passed, this.at + 0.999));
        window.requestAnimationFrame(step);
      };
      window.requestAnimationFrame(step);
    }

    key(event) {
      const step = event.shiftKey ? 10 : 1;
      const moves = {
        " ": () => this.toggle(),
        ArrowLeft: () => this.go(this.at - step),
        ArrowRight: () => this.go(this.at + step),
        Home: () => this.go(0),
        End: () => this.go(this.last()),
      };
      if (!moves[event.key]) return;
      event.preventDefault();
      moves[event.key]();
    }

    point(event) {
      const box = this.chip.canvas.getBoundingClientRect(), scale = this.chip.width / box.width;
      const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
      const { places, side } = this.layout;
      this.pointed = places.findIndex(([left, top]) => x >= left && x < left + side && y >= top && y < top + side);
      this.tellCore();
    }

    tellCore() {
      const core = this.pointed, used = this.replay.chip.utilization[core];
      if (core === undefined || core < 0) return;
      const cores = this.cores || { operations: [], spikes: [] };
      this.about.textContent = !used ? `core ${core}: not in use`
        : `core ${core} ${used.label}: ${(cores.operations[core] || 0).toLocaleString("en")} synaptic operations and `
          + `${(cores.spikes[core] || 0).toLocaleString("en")} spikes in this tick; ${used.compartments.used} compartments, `
          + `${used.synapse_words.used} of ${used.synapse_words.limit} memory words`;
    }

    inks() {
      const style = window.getComputedStyle(this.root);
      const ink = (name, otherwise) => style.getPropertyValue("--" + name).trim() || otherwise;
      return {
        text: ink("text", "#222222"), solid: ink("solid", "#9aa3ad"), empty: ink("empty", "#eeeeee"),
        robot: ink("robot", "#1f77b4"), event: ink("event", "#c2410c"), energy: ink("energy", "#8a3ffc"), mover: ink("mover", "#ff9f1c"),
        track: "#ff9f1c66", goal: "#d6272859", goalLine: "#d62728", laser: "#2ca02c2e", ahead: "#88888888",
      };
    }

    draw() {
      const { replay, episode, at } = this, tick = episode.ticks[at], ink = this.inks();
      drawArena(this.arena, ink, replay, episode, at);
      drawEvents(this.events, ink, replay, tick);
      drawState(this.state, tick);
      this.cores = replay.chip && tick ? coresOf(tick) : null;
      if (replay.chip) {
        const counts = this.cores ? this.cores[this.counted] : [];
        drawChip(this.chip, ink, replay.chip, this.layout, counts, this.most[this.counted]);
        this.tellCore();
      }
      this.raster.draw(this.spikes, ink, at);
      this.bars.forEach(({ bar, number }, layer) => {
        const spikes = tick ? tick.layer_spikes[layer] : 0;
        bar.style.width = 120 * spikes / this.mostOfLayer[layer] + "px";
        number.textContent = spikes.toLocaleString("en");
      });
      drawStrip(this.strip, ink, replay, episode, at);
      this.tell(tick);
    }

    tell(tick) {
      const { replay, episode, at } = this, milli = (value) => (value / 1000).toFixed(2);
      const rows = [["tick", `${at} of ${episode.ticks.length}`],
        ["time", (at / replay.settings.control_hz).toFixed(2) + " s"]];
      if (tick) {
        rows.push(["goal", milli(tick.goal_mm) + " m away"],
          ["speed", `${milli(tick.speed[0])} m/s, ${milli(tick.speed[1])} rad/s`],
          ["wheels", `${milli(tick.action[0])}, ${milli(tick.action[1])} of the fastest`]);
        replay.cost_tables.forEach((name, index) => rows.push([name,
          `${(tick.dynamic_fj[index] / 1e12).toFixed(2)} mJ, ${(tick.time_ps[index] / 1e9).toFixed(1)} ms so far`]));
      } else {
        rows.push(["end", episode.outcome + (episode.hit ? " with " + episode.hit : "")]);
      }
      this.readout.replaceChildren();
      rows.forEach(([name, value]) => {
        element("dt", this.readout, { textContent: name });
        element("dd", this.readout, { textContent: value });
      });
    }
  }

  const players = [];
  let active = null;
  async function start(section) {
    try {
      const player = new Player(section, await readReplay(section.querySelector("script").textContent));
      players.push(player);
      active = active || player;
      section.addEventListener("pointerdown", () => { active = player; });
    } catch (error) {
      // The still picture is there.
      section.querySelector(".player").textContent = `This browser cannot play the trial: ${error.message}`;
    }
  }

  document.addEventListener("keydown", (event) => {
    const name = event.target && event.target.tagName;
    const typing = name === "SELECT" || (name === "BUTTON" && event.key === " ");
    const sliding = name === "INPUT" && event.key !== " ";
    if (active && !typing && !sliding) active.key(event);
  });
  if (window.matchMedia) {
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => players.forEach((player) => player.draw()));
  }
  window.addEventListener("resize", () => players.forEach((player) => player.fit()));
  const sections = Array.from(document.querySelectorAll("section.replay"));
  const ready = sections.reduce((before, section) => before.then(() => start(section)), Promise.resolve());
  // For whoever wants to read the data from a console, once `ready` is done.
  window.spikeloop = { ready, players, coresOf, spikesOf };
})();
