// Messages of the server: a header in JSON, and arrays that are looked at where they lie.

const VIEWS = {
  f4: Float32Array, f8: Float64Array, i4: Int32Array, u4: Uint32Array, i2: Int16Array, u1: Uint8Array,
};

/** Give the header of a message, with its arrays in place of their descriptions. */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const from = 4 + length, arrays = {};
  for (const [name, [code, at, count]] of Object.entries(header.arrays)) {
    arrays[name] = new VIEWS[code](buffer, from + at, count);
  }
  header.arrays = arrays;
  return header;
}
