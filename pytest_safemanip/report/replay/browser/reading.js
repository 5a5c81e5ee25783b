/* Reads a replay's data: numbers in base64, places in 16 bits a coordinate. */
(function () {
  "use strict";

  window.SafemanipReplay = window.SafemanipReplay || {inner: {}};

  const STILL = 65535; // -1 as an unsigned 16-bit number

  function bytes(text) {
    const raw = atob(text);
    const found = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) found[i] = raw.charCodeAt(i);
    return found.buffer;
  }

  const uint8 = (text) => new Uint8Array(bytes(text));
  const uint16 = (text) => new Uint16Array(bytes(text));
  const int16 = (text) => new Int16Array(bytes(text));
  const uint32 = (text) => new Uint32Array(bytes(text));
  const float32 = (text) => new Float32Array(bytes(text));

  /** Reads one place of packed places into a vector; `row` chooses the bounds. */
  function place(packed, levels, index, row, vector) {
    const at = (axis) => packed.low[3 * row + axis] +
      (packed.size[3 * row + axis] * levels[3 * index + axis]) / 65535;
    return vector.set(at(0), at(1), at(2));
  }

  /** A quaternion from wxyz. */
  function turn(values, index, scale, quaternion) {
    const i = 4 * index;
    return quaternion.set(
      values[i + 1] / scale, values[i + 2] / scale, values[i + 3] / scale, values[i] / scale
    ).normalize();
  }

  function read(data) {
    const contacts = data.contacts;
    const frames = uint32(data.frames);
    const moments = Array.from({length: Math.ceil(data.steps / contacts.stride)}, () => []);
    const moment = uint32(contacts.moment), lasting = uint16(contacts.lasting);
    for (let row = 0; row < moment.length; row++) {
      for (let i = 0; i < lasting[row]; i++) moments[moment[row] + i].push(row);
    }
    return {
      frames,
      moments,
      trackPlaces: uint16(data.tracks.places.data),
      trackTurns: int16(data.tracks.turns),
      contactPair: uint16(contacts.pair),
      contactForce: uint16(contacts.force),
      contactPlaces: uint16(contacts.places.data),
      contactNormals: int16(contacts.normals),
      solids: {
        entity: uint32(data.solids.entity),
        form: uint8(data.solids.form),
        track: uint16(data.solids.track),
        half: float32(data.solids.half),
        pose: float32(data.solids.pose),
      },
    };
  }

  Object.assign(SafemanipReplay.inner, {STILL, place, read, turn, uint16});
})();
