/*
 * Replays a rollout in 3D.
 *
 *   const replay = SafemanipReplay.mount(element, data, {onStep: (step) => ..., controls: true});
 *   replay.seek(120); replay.highlight(["obj"]); replay.highlight(null); replay.dispose();
 *
 * element: filled with the replay, which is as large as it is. A browser draws some 16 of them at a
 * time: dispose() of what is out of sight.
 * data: what pytest_safemanip.report.replay.pack gives.
 * onStep: called with each step that playing or the controls bring; not by seek.
 * controls: whether there are buttons and a slider below the picture, and the violation is told in
 * it; without, the page around has its own.
 * wheel: whether the mouse wheel zooms at once; otherwise after a click on the picture, so that it
 * does not stop who scrolls a page.
 * look(property, first): where the violation of a property that begins at a step is seen best.
 * highlight(null) goes back to the entities of the violations.
 *
 * Needs three.min.js, and the other scripts of this folder before it. World frame: metres, z up.
 */
(function () {
  "use strict";

  const {
    MOST_ARROWS, STILL, THEMES, arrows, build, fixtureColour, lightness, make, panel, place, read,
    seconds, turn, words,
  } = SafemanipReplay.inner;
  const NEWTON_PER_METRE = 100;
  const SHORTEST_ARROW = 0.02, LONGEST_ARROW = 0.4, WHOLE_HEAD = 0.08;
  const SMALL = 320; // pixels: below, fewer contacts are listed
  const FADED = 0.6; // how grey the meshes are that are not marked
  const NO_WEBGL =
    "This browser shows no 3D here: WebGL is missing or turned off. The timeline, the table of " +
    "steps and `safemanip video` show the same.";

  function mount(element, data, options = {}) {
    if (data.schema !== 1) throw new Error(`replay: schema ${data.schema} is not known`);
    const T = window.SafemanipThree;
    const root = make("div", "smr", element);
    const ui = panel(root, data, options.controls !== false);
    let renderer;
    try {
      renderer = new T.WebGLRenderer({canvas: ui.canvas, antialias: true});
    } catch (error) {
      ui.stage.replaceChildren(make("p", "smr-missing", null, NO_WEBGL));
      ui.bar.hidden = true;
      return {seek() {}, highlight() {}, look() {}, dispose: () => root.remove(), webgl: false};
    }
    return new Replay(T, root, ui, renderer, data, options.onStep || (() => {}), Boolean(options.wheel));
  }

  class Replay {
    constructor(T, root, ui, renderer, data, onStep, wheel) {
      Object.assign(this, {T, root, ui, renderer, data, onStep, webgl: true});
      this.found = read(data);
      this.scene = new T.Scene();
      this.camera = new T.PerspectiveCamera(42, 1, 0.02, 60);
      this.camera.up.set(0, 0, 1);
      this.controls = new T.OrbitControls(this.camera, ui.canvas);
      this.controls.maxDistance = 15;
      this.controls.minDistance = 0.15;
      // Whoever scrolls through a page is not stopped by what is in it.
      this.controls.enableZoom = wheel;
      if (!wheel) {
        ui.canvas.addEventListener("focus", () => (this.controls.enableZoom = true));
        ui.canvas.addEventListener("blur", () => (this.controls.enableZoom = false));
        // Two fingers on the picture mean the picture.
        const touched = (event) => event.pointerType === "touch" && (this.controls.enableZoom = true);
        ui.canvas.addEventListener("pointerdown", touched, true);
      }
      this.light = new T.HemisphereLight("#ffffff", "#8a8f98", 1.9);
      this.light.position.set(0, 0, 1);
      this.sun = new T.DirectionalLight("#ffffff", 1.5);
      this.scene.add(this.light, this.sun, this.sun.target);
      this.pieces = build(T, data, this.found, this.scene);
      this.arrows = arrows(T, this.scene);
      this.labels = new Map();
      this.step = data.findings.length ? data.findings[0].first : 0;
      this.playing = false;
      this.byViolations = true;
      this.highlighted = new Set();
      this._trace();
      this._listen();
      this._resetView();
      this._theme();
      this.highlight(null);
      this._resize();
      this._show();
    }

    /** Shows a step; a number with a fraction is between two. */
    seek(step) {
      // Whoever follows onStep asks for the step that is playing.
      if (this.playing && Math.round(step) === Math.round(this.step)) return;
      this._pause();
      this._go(step, false);
    }

    /** Marks the entities of these names; null: those of the violations. */
    highlight(names) {
      this.byViolations = names === null || names === undefined;
      const wanted = this.byViolations
        ? this.data.findings.flatMap((finding) => finding.guilty)
        : this.data.entities.flatMap((entity, i) => (names.includes(entity.name) ? [i] : []));
      this.highlighted = new Set(wanted);
      for (const label of this.labels.values()) label.remove();
      this.labels.clear();
      this._trace();
      for (const entity of this.highlighted) {
        this.labels.set(entity, make("span", "smr-label", this.ui.labels, words(this.data, entity)));
      }
      this._paint();
      this._draw();
    }

    /** Draws the ways of the marked objects. */
    _trace() {
      const {T, data, found} = this;
      if (this.trails) {
        this.scene.remove(this.trails);
        this.trails.geometry.dispose();
        this.trails.material.dispose();
      }
      const tracks = new Set(this.pieces.filter((piece) =>
        piece.kind === "object" && piece.track !== STILL && this.highlighted.has(piece.entity)
      ).map((piece) => piece.track));
      const points = [], at = new T.Vector3(), count = data.tracks.count;
      for (const track of tracks) {
        for (let frame = 0; frame < found.frames.length; frame++) {
          place(data.tracks.places, found.trackPlaces, frame * count + track, track, at);
          points.push(at.x, at.y, at.z);
          // Each point but the first and the last ends a segment and begins another.
          if (frame > 0 && frame < found.frames.length - 1) points.push(at.x, at.y, at.z);
        }
      }
      const geometry = new T.BufferGeometry();
      geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(points), 3));
      const material = new T.LineBasicMaterial({transparent: true, opacity: 0.7});
      this.trails = new T.LineSegments(geometry, material);
      this.trails.frustumCulled = false;
      this.scene.add(this.trails);
    }

    /** Takes everything back. */
    dispose() {
      this._pause();
      cancelAnimationFrame(this.pending);
      this.observer.disconnect();
      this.dark.removeEventListener("change", this.onTheme);
      this.themed.disconnect();
      this.controls.dispose();
      this.scene.traverse((thing) => {
        if (thing.geometry) thing.geometry.dispose();
        if (thing.material) thing.material.dispose();
      });
      this.renderer.dispose();
      this.renderer.forceContextLoss();
      this.root.remove();
    }

    // -------------------------------------------------------------- events

    _listen() {
      const {ui} = this;
      this.controls.addEventListener("change", () => this._draw());
      ui.slider.addEventListener("input", () => this._chosen(Number(ui.slider.value)));
      ui.play.addEventListener("click", () => (this.playing ? this._pause() : this._play()));
      ui.jump.addEventListener("click", () => this._chosen(this._nextViolation()));
      ui.reset.addEventListener("click", () => this._resetView());
      ui.canvas.addEventListener("keydown", (event) => this._key(event));
      ui.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
      ui.canvas.addEventListener("webglcontextrestored", () => this._draw());
      this.observer = new ResizeObserver(() => this._resize());
      this.observer.observe(ui.stage);
      this.dark = window.matchMedia("(prefers-color-scheme: dark)");
      this.onTheme = () => this._theme();
      this.dark.addEventListener("change", this.onTheme);
      // A page may have a switch of its own.
      this.themed = new MutationObserver(this.onTheme);
      this.themed.observe(document.documentElement, {attributeFilter: ["data-theme", "class"]});
    }

    _key(event) {
      const jumps = {ArrowLeft: -1, ArrowRight: 1, PageDown: -20, PageUp: 20};
      if (event.key === " ") (this.playing ? this._pause() : this._play());
      else if (event.key in jumps) this._chosen(Math.round(this.step) + jumps[event.key]);
      else if (event.key === "Home") this._chosen(0);
      else if (event.key === "End") this._chosen(this.data.steps - 1);
      else return;
      event.preventDefault();
      event.stopPropagation();
    }

    _nextViolation() {
      const firsts = this.data.findings.map((finding) => finding.first);
      const later = firsts.filter((first) => first > Math.round(this.step));
      return Math.min(...(later.length ? later : firsts));
    }

    _play() {
      this.playing = true;
      this.ui.play.textContent = "\u275a\u275a";
      this.ui.play.setAttribute("aria-label", "pause");
      if (this.step >= this.data.steps - 1) this._go(0);
      let before = null;
      const tick = (now) => {
        if (!this.playing) return;
        if (before !== null) this._go(this.step + (now - before) / 1000 / this.data.dt);
        before = now;
        if (this.step >= this.data.steps - 1) this._pause();
        else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    _pause() {
      this.playing = false;
      this.ui.play.textContent = "\u25b6";
      this.ui.play.setAttribute("aria-label", "play");
    }

    _chosen(step) {
      this._pause();
      this._go(step);
    }

    _go(step, told = true) {
      const shown = Math.round(this.step);
      this.step = Math.min(Math.max(Number(step) || 0, 0), this.data.steps - 1);
      this._show();
      if (told && Math.round(this.step) !== shown) this.onStep(Math.round(this.step));
    }

    // -------------------------------------------------------------- what is shown

    /** The frame at or before the step, and how far it is to the next. */
    _frame() {
      const {frames} = this.found;
      let low = 0, high = frames.length - 1;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (frames[middle] <= this.step) low = middle;
        else high = middle - 1;
      }
      const next = Math.min(low + 1, frames.length - 1);
      const gap = frames[next] - frames[low];
      return [low, next, gap ? (this.step - frames[low]) / gap : 0];
    }

    _show() {
      const {T, data, found} = this;
      const [frame, next, share] = this._frame();
      const count = data.tracks.count;
      const at = new T.Vector3(), after = new T.Vector3();
      const from = new T.Quaternion(), to = new T.Quaternion();
      const poses = [];
      for (let track = 0; track < count; track++) {
        place(data.tracks.places, found.trackPlaces, frame * count + track, track, at);
        place(data.tracks.places, found.trackPlaces, next * count + track, track, after);
        turn(found.trackTurns, frame * count + track, 32767, from);
        turn(found.trackTurns, next * count + track, 32767, to);
        poses.push([at.clone().lerp(after, share), from.clone().slerp(to, share)]);
      }
      for (const piece of this.pieces) {
        if (piece.track === STILL) continue;
        piece.group.position.copy(poses[piece.track][0]);
        piece.group.quaternion.copy(poses[piece.track][1]);
      }
      this._touch(Math.floor(Math.round(this.step) / data.contacts.stride));
      this._say();
      this._draw();
    }

    _touch(moment) {
      const {T, data, found, arrows: {shaft, head}} = this;
      const rows = [...found.moments[moment]];
      rows.sort((a, b) => found.contactForce[b] - found.contactForce[a]);
      const at = new T.Vector3(), along = new T.Vector3(), up = new T.Vector3(0, 1, 0);
      const rotation = new T.Quaternion(), matrix = new T.Matrix4();
      this.touching = rows.map((row) => ({
        pair: data.contacts.pairs[found.contactPair[row]], force: found.contactForce[row] / 10,
      }));
      const shown = rows.slice(0, MOST_ARROWS);
      shown.forEach((row, i) => {
        const pair = data.contacts.pairs[found.contactPair[row]];
        place(data.contacts.places, found.contactPlaces, row, 0, at);
        along.fromArray(found.contactNormals, 3 * row).normalize();
        // The force on what is not the robot.
        if (data.entities[pair[2]].kind === "robot") along.negate();
        const length = Math.min(
          Math.max(found.contactForce[row] / 10 / NEWTON_PER_METRE, SHORTEST_ARROW), LONGEST_ARROW);
        rotation.setFromUnitVectors(up, along);
        const size = Math.min(1, length / WHOLE_HEAD);
        shaft.setMatrixAt(i, matrix.compose(at, rotation, new T.Vector3(size, length, size)));
        at.addScaledVector(along, length);
        head.setMatrixAt(i, matrix.compose(at, rotation, new T.Vector3(size, size, size)));
      });
      for (const mesh of [shaft, head]) {
        mesh.count = shown.length;
        mesh.instanceMatrix.needsUpdate = true;
      }
    }

    _say() {
      const {ui, data} = this;
      const step = Math.round(this.step);
      ui.slider.value = step;
      ui.clock.textContent = `step ${step} of ${data.steps - 1}, ${seconds(step, data.dt)}`;
      ui.readout.replaceChildren();
      const hard = this.touching.filter(({pair}) =>
        [pair[0], pair[2]].some((i) => data.entities[i].kind === "robot" || this.highlighted.has(i)));
      // Beside a page's own lanes the picture needs its room.
      const few = ui.bar.hidden || ui.stage.clientHeight < SMALL;
      for (const {pair, force} of hard.slice(0, few ? 2 : 4)) {
        const sides = [0, 2].map((i) => `${data.entities[pair[i]].name}/${pair[i + 1]}`);
        // As the arrow: what the robot does to other things.
        if (data.entities[pair[2]].kind === "robot") sides.reverse();
        make("div", "", ui.readout, `${force.toFixed(1)} N  ${sides.join(" on ")}`);
      }
      if (hard.length && !few) make("div", "smr-scale", ui.readout, "arrows: 10 cm for 10 N");
      const now = data.findings.filter((f) => f.first <= step && step <= f.last);
      const near = data.findings.find((f) => f.first <= step) || data.findings[0];
      ui.message.replaceChildren();
      ui.message.hidden = data.findings.length === 0 || ui.bar.hidden;
      ui.message.classList.toggle("smr-now", now.length > 0);
      for (const finding of now.length ? now.slice(0, 2) : near ? [near] : []) {
        const when = `step ${finding.first}, ${seconds(finding.first, data.dt)}`;
        const head = now.length ? "VIOLATED" : step < finding.first ? "will violate" : "violated";
        make("b", "", ui.message, `${head} ${finding.property}`);
        make("div", "", ui.message, [...finding.evidence.slice(0, 2), when].join("; "));
      }
    }

    // -------------------------------------------------------------- how it looks

    _theme() {
      const wish = document.documentElement.dataset.theme;
      const name = wish === "dark" || wish === "light" ? wish : this.dark.matches ? "dark" : "light";
      this.themeName = name;
      this.theme = THEMES[name];
      this.root.dataset.theme = name;
      this.renderer.setClearColor(this.theme.back);
      for (const mesh of Object.values(this.arrows)) mesh.material.color.set(this.theme.contact);
      this._paint();
      this._draw();
    }

    _paint() {
      const {T, theme, data} = this;
      const guilty = new T.Color(theme.guilty), grey = new T.Color();
      this.trails.material.color.copy(guilty);
      for (const piece of this.pieces) {
        const marked = this.highlighted.has(piece.entity);
        const {kind, category} = data.entities[piece.entity];
        const colour = new T.Color(piece.colour ||
          (kind === "fixture" ? fixtureColour(category, this.themeName) : theme[kind]));
        if (piece.surface) {
          // A guilty object is all of that colour; of a large fixture that would hide the rest.
          if (marked) colour.lerp(guilty, kind === "fixture" || kind === "room" ? 0.15 : 0.85);
          // Paler than what is guilty, whatever their own colours are.
          else if (piece.colour) colour.lerp(grey.setScalar(lightness(colour)), FADED);
          piece.surface.material.color.copy(colour);
          // Guilty objects glow a little, so that shadow does not change their colour.
          const glows = marked && kind === "object";
          piece.surface.material.emissive.copy(guilty).multiplyScalar(glows ? 0.35 : 0);
        }
        if (piece.edges) {
          // On a dark mesh, edges are lighter than it.
          const dark = piece.colour && lightness(piece.surface.material.color) < 0.1;
          piece.edges.material.color.set(marked ? theme.guilty : dark ? theme.robot : theme.edge);
          piece.edges.material.opacity = marked ? 1 : kind === "room" ? 0.15 : 0.35;
          // What is guilty is seen through what is in front of it.
          piece.edges.material.depthTest = !(marked && kind === "object");
          piece.edges.renderOrder = marked ? 5 : 0;
        }
      }
    }

    /** Look at the finding of a property that begins at a step. */
    look(property, first) {
      const found = this.data.findings.find((f) => f.property === property && f.first === first);
      this._resetView(found && found.view);
    }

    _resetView(view = this.data.view) {
      this.camera.position.fromArray(view.eye);
      this.controls.target.fromArray(view.target);
      this.controls.update();
      this._draw();
    }

    _resize() {
      const {clientWidth: width, clientHeight: height} = this.ui.stage;
      if (!width || !height) return;
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.ui.stage.classList.toggle("smr-small", height < SMALL);
      // In a narrow element, as much to either side as in a square one.
      this.camera.fov = width < height ? 2 * Math.atan(0.384 * (height / width)) * 57.29578 : 42;
      this.camera.updateProjectionMatrix();
      this._render();
    }

    /** Draws before the next refresh, once however often it is asked for. */
    _draw() {
      if (this.pending) return;
      this.pending = requestAnimationFrame(() => {
        this.pending = 0;
        this._render();
      });
    }

    _render() {
      this._openWalls();
      this.sun.position.copy(this.camera.position).add(new this.T.Vector3(0.4, -0.3, 1.5));
      this.sun.target.position.copy(this.controls.target);
      this.renderer.render(this.scene, this.camera);
      this._placeLabels();
    }

    /** Hides a wall, floor or ceiling that is between the camera and what it looks at. */
    _openWalls() {
      const {T} = this;
      const step = new T.Vector3(), way = new T.Vector3();
      for (const piece of this.pieces) {
        if (piece.kind !== "room" || !piece.surface) continue;
        const box = piece.surface.geometry.boundingBox;
        way.subVectors(this.controls.target, this.camera.position);
        piece.group.visible = true;
        for (let share = 0; share < 0.95 && piece.group.visible; share += 0.02) {
          step.copy(this.camera.position).addScaledVector(way, share);
          if (box.distanceToPoint(step) < 0.04) piece.group.visible = false;
        }
      }
    }

    _placeLabels() {
      const {T, ui: {stage, message, readout}} = this;
      const top = message.hidden ? 4 : message.offsetTop + message.offsetHeight + 4;
      const bottom = (readout.offsetTop || stage.clientHeight) - 4;
      const point = new T.Vector3();
      for (const [entity, label] of this.labels) {
        const own = this.pieces.filter((p) => p.entity === entity && p.surface);
        if (!own.length) {
          label.hidden = true;
          continue;
        }
        own[0].surface.geometry.boundingBox.getCenter(point);
        point.z = own[0].surface.geometry.boundingBox.max.z;
        point.applyMatrix4(own[0].group.matrixWorld).project(this.camera);
        label.hidden = point.z > 1;
        // What is beyond the picture has its label at the edge.
        const {clientWidth: width, clientHeight: height} = stage;
        const [wide, high] = [label.offsetWidth, label.offsetHeight];
        const x = ((point.x + 1) / 2) * width - wide / 2;
        const y = ((1 - point.y) / 2) * height - high - 6;
        const inside = (value, least, most) => Math.round(Math.max(Math.min(value, most), least));
        label.style.transform =
          `translate(${inside(x, 4, width - wide - 4)}px, ${inside(y, top, bottom - high)}px)`;
      }
    }
  }

  SafemanipReplay.mount = mount;
})();
