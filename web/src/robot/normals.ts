// Normals of triangles without shared vertices (STL): smooth across flat edges, sharp across others.

// Gives equal points the same number: exactly equal, because writers of such files copy them.
function numberPoints(positions: Float32Array): { ids: Uint32Array; count: number } {
  const n = positions.length / 3;
  const bits = new Uint32Array(positions.buffer, positions.byteOffset, positions.length);
  let size = 1;
  while (size < n * 2) size *= 2;
  const table = new Int32Array(size).fill(-1); // first corner with such a point
  const ids = new Uint32Array(n);
  let count = 0;
  for (let i = 0; i < n; i += 1) {
    const o = i * 3;
    for (let k = 0; k < 3; k += 1) if (positions[o + k] === 0) positions[o + k] = 0; // -0 is 0
    let slot = (Math.imul(bits[o]!, 73856093) ^ Math.imul(bits[o + 1]!, 19349663) ^ Math.imul(bits[o + 2]!, 83492791)) >>> 0;
    slot = (slot ^ (slot >>> 15)) & (size - 1);
    for (;;) {
      const first = table[slot]!;
      if (first < 0) {
        table[slot] = i;
        ids[i] = count;
        count += 1;
        break;
      }
      const f = first * 3;
      if (bits[f] === bits[o] && bits[f + 1] === bits[o + 1] && bits[f + 2] === bits[o + 2]) {
        ids[i] = ids[first]!;
        break;
      }
      slot = (slot + 1) & (size - 1);
    }
  }
  return { ids, count };
}

// `positions`: nine numbers per triangle; `crease`: the angle in rad between faces above which an edge stays sharp. A
// corner's normal is the mean, weighted by area, of the faces around its point with a smaller angle to its own face.
export function creasedNormals(positions: Float32Array, crease: number): Float32Array {
  const corners = positions.length / 3, faces = corners / 3;
  const face = new Float32Array(faces * 3); // as long as twice the area
  const length = new Float32Array(faces);
  for (let f = 0; f < faces; f += 1) {
    const o = f * 9;
    const ax = positions[o + 3]! - positions[o]!, ay = positions[o + 4]! - positions[o + 1]!, az = positions[o + 5]! - positions[o + 2]!;
    const bx = positions[o + 6]! - positions[o]!, by = positions[o + 7]! - positions[o + 1]!, bz = positions[o + 8]! - positions[o + 2]!;
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    face.set([x, y, z], f * 3);
    length[f] = Math.hypot(x, y, z);
  }
  const { ids, count } = numberPoints(positions);
  const start = new Uint32Array(count + 1);
  for (let i = 0; i < corners; i += 1) start[ids[i]! + 1]! += 1;
  for (let i = 0; i < count; i += 1) start[i + 1]! += start[i]!;
  const filled = start.slice(0, count);
  const around = new Uint32Array(corners); // faces by point
  for (let i = 0; i < corners; i += 1) {
    const id = ids[i]!;
    around[filled[id]!] = Math.floor(i / 3);
    filled[id]! += 1;
  }
  const flat = Math.cos(crease);
  const out = new Float32Array(corners * 3);
  for (let i = 0; i < corners; i += 1) {
    const own = Math.floor(i / 3), id = ids[i]!;
    const ox = face[own * 3]!, oy = face[own * 3 + 1]!, oz = face[own * 3 + 2]!;
    let x = 0, y = 0, z = 0;
    for (let k = start[id]!; k < start[id + 1]!; k += 1) {
      const f = around[k]!;
      const fx = face[f * 3]!, fy = face[f * 3 + 1]!, fz = face[f * 3 + 2]!;
      if (fx * ox + fy * oy + fz * oz < flat * length[f]! * length[own]!) continue;
      x += fx;
      y += fy;
      z += fz;
    }
    const size = Math.hypot(x, y, z) || 1;
    out[i * 3] = x / size;
    out[i * 3 + 1] = y / size;
    out[i * 3 + 2] = z / size;
  }
  return out;
}
