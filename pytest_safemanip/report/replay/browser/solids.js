/* Builds the things of a replay from its data, once. */
(function () {
  "use strict";

  window.SafemanipReplay = window.SafemanipReplay || {inner: {}};

  const {STILL, uint16} = SafemanipReplay.inner;
  const MOST_ARROWS = 96;
  const SHARP = 40; // degrees between the sides of an edge that is drawn

  /** Concatenates geometries that have places, normals and indices. */
  function merged(T, geometries) {
    let points = 0, corners = 0;
    for (const g of geometries) {
      points += g.attributes.position.count;
      corners += g.index.count;
    }
    const position = new Float32Array(3 * points), normal = new Float32Array(3 * points);
    const index = new Uint32Array(corners);
    let p = 0, c = 0;
    for (const g of geometries) {
      position.set(g.attributes.position.array, 3 * p);
      normal.set(g.attributes.normal.array, 3 * p);
      for (let i = 0; i < g.index.count; i++) index[c + i] = g.index.array[i] + p;
      p += g.attributes.position.count;
      c += g.index.count;
      g.dispose();
    }
    const found = new T.BufferGeometry();
    found.setAttribute("position", new T.BufferAttribute(position, 3));
    found.setAttribute("normal", new T.BufferAttribute(normal, 3));
    found.setIndex(new T.BufferAttribute(index, 1));
    return found;
  }

  function mergedLines(T, geometries) {
    const total = geometries.reduce((sum, g) => sum + g.attributes.position.count, 0);
    const position = new Float32Array(3 * total);
    let p = 0;
    for (const g of geometries) {
      position.set(g.attributes.position.array, 3 * p);
      p += g.attributes.position.count;
      g.dispose();
    }
    const found = new T.BufferGeometry();
    found.setAttribute("position", new T.BufferAttribute(position, 3));
    return found;
  }

  /** The surface and the edges of one solid, placed in the frame of its track. */
  function shapes(T, solids, index) {
    const half = solids.half.subarray(3 * index, 3 * index + 3);
    const p = 7 * index;
    const matrix = new T.Matrix4().compose(
      new T.Vector3(solids.pose[p], solids.pose[p + 1], solids.pose[p + 2]),
      new T.Quaternion(
        solids.pose[p + 4], solids.pose[p + 5], solids.pose[p + 6], solids.pose[p + 3]),
      new T.Vector3(1, 1, 1)
    );
    const form = solids.form[index];
    if (form === 1) {
      // three's capsules lie along y, ours along z.
      const capsule = new T.CapsuleGeometry(half[0], 2 * half[2], 6, 18);
      capsule.rotateX(Math.PI / 2);
      return {surface: capsule.applyMatrix4(matrix), edges: null};
    }
    const box = new T.BoxGeometry(2 * half[0], 2 * half[1], 2 * half[2]).applyMatrix4(matrix);
    const edges = new T.EdgesGeometry(box);
    if (form === 2) {
      box.dispose();
      return {surface: null, edges};
    }
    return {surface: box, edges};
  }

  /** Builds a mesh for each entity and track; gives them with what they belong to. */
  function build(T, data, found, scene) {
    const groups = new Map();
    for (let i = 0; i < found.solids.entity.length; i++) {
      const entity = found.solids.entity[i], track = found.solids.track[i];
      // Walls and floor are hidden one by one, when they are in the way.
      const alone = data.entities[entity].kind === "room" ? i : "";
      const key = `${entity}/${track}/${alone}`;
      if (!groups.has(key)) groups.set(key, {entity, track, surfaces: [], edges: []});
      const shape = shapes(T, found.solids, i);
      if (shape.surface) groups.get(key).surfaces.push(shape.surface);
      if (shape.edges) groups.get(key).edges.push(shape.edges);
    }
    const pieces = [];
    for (const {entity, track, surfaces, edges} of groups.values()) {
      const group = new T.Group();
      const piece = {entity, track, group, kind: data.entities[entity].kind};
      if (surfaces.length) {
        piece.surface = new T.Mesh(merged(T, surfaces), new T.MeshLambertMaterial());
        piece.surface.geometry.computeBoundingBox();
        group.add(piece.surface);
      }
      if (edges.length) {
        const material = new T.LineBasicMaterial({transparent: true});
        piece.edges = new T.LineSegments(mergedLines(T, edges), material);
        group.add(piece.edges);
      }
      scene.add(group);
      pieces.push(piece);
    }
    for (const skin of data.skins) {
      const group = new T.Group();
      const material = new T.MeshLambertMaterial({flatShading: true, side: T.DoubleSide});
      const surface = new T.Mesh(skinned(T, skin), material);
      surface.geometry.computeBoundingBox();
      group.add(surface);
      scene.add(group);
      const track = skin.track < 0 ? STILL : skin.track;
      const kind = data.entities[skin.entity].kind;
      const piece = {entity: skin.entity, track, group, kind, surface, colour: skin.colour};
      if (kind === "fixture") {
        // Cupboards are of one colour: without edges, nobody sees their shelves.
        const edges = new T.EdgesGeometry(surface.geometry, SHARP);
        piece.edges = new T.LineSegments(edges, new T.LineBasicMaterial({transparent: true}));
        group.add(piece.edges);
      }
      pieces.push(piece);
    }
    return pieces;
  }

  /** The geometry of a mesh; its triangles are flat, so that it needs no normals. */
  function skinned(T, skin) {
    const levels = uint16(skin.points.data);
    const points = new Float32Array(levels.length);
    for (let i = 0; i < levels.length; i++) {
      points[i] = skin.points.low[i % 3] + (skin.points.size[i % 3] * levels[i]) / 65535;
    }
    const found = new T.BufferGeometry();
    found.setAttribute("position", new T.BufferAttribute(points, 3));
    found.setIndex(new T.BufferAttribute(uint16(skin.triangles), 1));
    return found;
  }

  /** Arrows of contacts: shafts and heads, as many as can be shown at once. */
  function arrows(T, scene) {
    const shaft = new T.CylinderGeometry(0.006, 0.006, 1, 10);
    shaft.translate(0, 0.5, 0);
    const head = new T.ConeGeometry(0.016, 0.04, 14);
    const make = (geometry) => {
      const mesh = new T.InstancedMesh(
        geometry, new T.MeshLambertMaterial({depthTest: false, transparent: true}), MOST_ARROWS);
      mesh.count = 0;
      mesh.frustumCulled = false;
      mesh.renderOrder = 10;
      scene.add(mesh);
      return mesh;
    };
    return {shaft: make(shaft), head: make(head)};
  }

  Object.assign(SafemanipReplay.inner, {MOST_ARROWS, arrows, build});
})();
