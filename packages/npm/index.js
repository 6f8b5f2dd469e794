// index.js - Spring Level Sets for JavaScript: deformable surfaces that are meshes, level sets and tracked points at once.
// `load` compiles springls.wasm, which springls.c is made to; index.d.ts describes what there is. Coordinates are those of the world.

const STATUS = ['OK', 'INVALID_ARGUMENT', 'OUT_OF_MEMORY', 'BAD_MESH', 'NON_FINITE', 'EMPTY_MODEL', 'CANCELLED', 'DEVICE_FAILED', 'BAD_SNAPSHOT'];
const MODES = ['fluid', 'elastic', 'advect_only'];
const OPERATIONS = ['union', 'intersection', 'difference'];
const MODEL_OPTIONS = ['size', 'spacing', 'origin', 'direction', 'follow', 'params', 'paper'];
const STEP_OPTIONS = ['dt', 'velocity', 'pressure', 'curvature', 'maxDisplacement', 'mode'];
const KINDS = ['all', 'frame'];

/** Reports a call that failed, in the words of the library. */
export class SpringlsError extends Error {
  constructor(status, message) {
    super(message);
    this.name = 'SpringlsError';
    this.status = status;
  }
}

const refuse = message => { throw new SpringlsError('INVALID_ARGUMENT', message); };

function numberOf(name, names, what) {
  const number = names.indexOf(name);
  return number < 0 ? refuse(`${what}: '${name}' is none of ${names.join(', ')}`) : number;
}

/** Whole numbers that C's int holds; others would be wrapped without a word. */
const isInteger = value => typeof value === 'number' && value === (value | 0);

/** Refuses a key that is a mistake, such as a misspelt one: it would do nothing. */
function checkKeys(options, names, what) {
  if (typeof options !== 'object' || options === null) refuse(`${what}: options are needed, an object`);
  for (const name of Object.keys(options)) {
    if (!names.includes(name)) refuse(`${what}: there is no option ${name}; there are ${names.join(', ')}`);
  }
}

function checkFunction(value, what) {
  if (typeof value !== 'function') refuse(`${what} is no function`);
}

function checkNumber(value, what) {
  if (typeof value !== 'number' || !Number.isFinite(value)) refuse(`${what} is no finite number: ${String(value)}`);
}

/** Holds the instance: its memory, and the functions of the caller's that the call in progress may run. */
class Library {
  constructor() {
    this.callbacks = null;
    this.failure = null;
    this.block = [];
  }

  imports() {
    return {
      callbacks: {
        velocity: (points, count, time, out) => this.run('velocity', out, 3 * count, [this.floats(points, 3 * count), time]),
        pressure: (points, normals, count, time, out) =>
          this.run('pressure', out, count, [this.floats(points, 3 * count), this.floats(normals, 3 * count), time]),
        distance: (points, count, out) => this.run('distance', out, count, [this.floats(points, 3 * count)]),
      },
      env: {emscripten_notify_memory_growth() {}},
      wasi_snapshot_preview1: new Proxy({}, {get: () => () => 52}),   // "not supported": nothing is read, written or ended
    };
  }

  /** Runs a function of the caller's. What it throws is thrown by the call that is in progress, which ends at the NaN. */
  run(name, out, count, values) {
    const result = this.floats(out, count);
    if (!this.failure) {
      try {
        const returned = this.callbacks[name](...values, result);
        if (typeof returned?.then !== 'function') return;
        returned.then(undefined, () => {});   // what it is rejected with is of no account any more
        refuse(`${name}: a callback may not be async, it has to be done when it returns`);
      } catch (error) {
        this.failure = {error};
      }
    }
    result.fill(NaN);
  }

  floats(address, count) { return new Float32Array(this.wasm.memory.buffer, address, count); }
  integers(address, count) { return new Int32Array(this.wasm.memory.buffer, address, count); }

  text(address) {
    const bytes = new Uint8Array(this.wasm.memory.buffer, address);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** Calls `work`, and frees what it has allocated. */
  call(work, callbacks = {}) {
    if (this.callbacks) refuse('a callback may not call the library');
    this.callbacks = callbacks;
    try {
      const result = work(this.wasm);
      if (this.failure) throw this.failure.error;
      return result;
    } finally {
      for (const address of this.block) this.wasm.release(address);
      this.block.length = 0;
      this.callbacks = this.failure = null;
    }
  }

  allocate(bytes) {
    const address = this.wasm.allocate(Math.max(bytes, 8));
    if (!address) throw new SpringlsError('OUT_OF_MEMORY', `${bytes} bytes do not fit in memory`);
    this.block.push(address);
    return address;
  }

  /** Copies numbers into the memory of the library. */
  put(values, Type) {
    const address = this.allocate(values.length * Type.BYTES_PER_ELEMENT);
    new Type(this.wasm.memory.buffer, address, values.length).set(values);
    return address;
  }

  putText(text) {
    const bytes = new TextEncoder().encode(text);
    return this.put([...bytes, 0], Uint8Array);
  }
}

function vector(values, length, what) {
  if (values.length !== length || Array.prototype.some.call(values, v => typeof v !== 'number')) refuse(`${what}: ${length} numbers are needed`);
  return Array.from(values);
}

/** A surface. */
class Model {
  #library;
  #address;

  constructor(library, options = {}) {
    checkKeys(options, MODEL_OPTIONS, 'create');
    const {size, spacing = [0, 0, 0], origin = [0, 0, 0], direction = new Array(9).fill(0), follow = false, params, paper = false} = options;
    this.#library = library;
    library.call(wasm => {
      const voxels = typeof size === 'number' ? [size, size, size] : vector(size ?? [], 3, 'size');
      if (voxels.some(n => !isInteger(n))) refuse(`size: whole numbers are needed, not ${voxels.join(', ')}`);
      const sizes = library.put(voxels, Int32Array), status = library.allocate(4);
      const place = library.put([...vector(spacing, 3, 'spacing'), ...vector(origin, 3, 'origin'), ...vector(direction, 9, 'direction')], Float64Array);
      this.#address = wasm.create(sizes, place, follow, status);
      if (!this.#address) {
        throw new SpringlsError(STATUS[-library.integers(status, 1)[0]], library.text(wasm.create_error(sizes, place, follow)));
      }
    });
    try {
      if (params || paper) this.setParams(params ?? {}, paper);
    } catch (error) {
      this.destroy();
      throw error;
    }
  }

  /** Calls the library; `work` returns its status. */
  #call(work, callbacks) {
    const library = this.#library;
    if (!this.#address) refuse('the model is destroyed');
    return library.call(wasm => {
      const {status = 0, result} = work(wasm, this.#address);
      if (status && !library.failure) throw new SpringlsError(STATUS[-status], library.text(wasm.last_error(this.#address)));
      return result;
    }, callbacks);
  }

  setParams(members, paper = false) {
    const library = this.#library;
    if (typeof members !== 'object' || members === null) refuse('params: an object is needed');
    this.#call((wasm, model) => {
      wasm.get_params(model, paper);
      for (const [name, value] of Object.entries(members)) {
        if (typeof value !== 'number' && typeof value !== 'boolean') refuse(`params: ${name} is no number`);
        const found = wasm.parameter(library.putText(name), Number(value));
        if (!found) refuse(`params: there is no ${name}`);
        if (found === 2) refuse(`params: ${name} is a whole number of 32 bits, not ${value}`);
      }
      return {status: wasm.set_params(model)};
    });
  }

  setMesh(positions, triangles) {
    const library = this.#library;
    if (positions.length % 3 || triangles.length % 3) refuse('setMesh: three numbers a point and a triangle are needed');
    const indices = Int32Array.from(triangles);
    if (indices.some((index, i) => index !== triangles[i])) refuse('setMesh: an index is no whole number');
    this.#call((wasm, model) => ({status: wasm.set_mesh(model, library.put(positions, Float32Array), positions.length / 3,
                                                        library.put(indices, Int32Array), indices.length / 3)}));
  }

  setLevelSet(phi) {
    if (phi.length !== this.#voxels()) refuse(`setLevelSet: ${this.#voxels()} values are needed, one a voxel`);
    this.#call((wasm, model) => ({status: wasm.set_level_set(model, this.#library.put(phi, Float32Array))}));
  }

  #voxels() { return this.#call((wasm, model) => ({result: wasm.voxels(model)})); }

  setImplicit(distance) {
    checkFunction(distance, 'setImplicit: distance');
    this.#call((wasm, model) => ({status: wasm.set_implicit(model)}), {distance});
  }

  step(options = {}) {
    checkKeys(options, STEP_OPTIONS, 'step');
    const {dt = 0, velocity, pressure, curvature = 0, maxDisplacement = 0, mode = 'fluid'} = options;
    for (const [name, value] of Object.entries({velocity, pressure})) {
      if (value !== undefined && value !== null) checkFunction(value, `step: ${name}`);
    }
    for (const [name, value] of Object.entries({dt, curvature, maxDisplacement})) {
      if (typeof value !== 'number') refuse(`step: ${name} is no number`);
    }
    const forces = (velocity ? 1 : 0) | (pressure ? 2 : 0), number = numberOf(mode, MODES, 'mode');
    this.#call((wasm, model) => ({status: wasm.step(model, number, forces, curvature, dt, maxDisplacement)}), {velocity, pressure});
  }

  settle(steps = 100) {
    if (!isInteger(steps)) refuse(`settle: a whole number of steps is needed, not ${String(steps)}`);
    this.#call((wasm, model) => ({status: wasm.settle(model, steps)}));
  }

  combine(operation, other) {
    const number = numberOf(operation, OPERATIONS, 'combine');
    if (typeof other === 'function') {
      this.#call((wasm, model) => ({status: wasm.combine_implicit(model, number)}), {distance: other});
    } else {
      if (!(other instanceof Model) || other.#library !== this.#library) refuse('combine: a model or a distance function is needed');
      if (!other.#address) refuse('combine: the other model is destroyed');
      this.#call((wasm, model) => ({status: wasm.combine(model, number, other.#address)}));
    }
  }

  mesh() {
    const library = this.#library;
    return this.#call((wasm, model) => {
      const out = library.allocate(7 * 4), status = wasm.extract_mesh(model, out);
      if (status) return {status};
      const [vertices, triangles, positions, normals, correspondences, springls, corners] = library.integers(out, 7);
      const floats = at => library.floats(at, 3 * vertices).slice();
      const result = {positions: floats(positions), normals: floats(normals), correspondences: floats(correspondences),
                      springls: library.integers(springls, vertices).slice(),
                      triangles: new Uint32Array(wasm.memory.buffer, corners, 3 * triangles).slice()};
      wasm.free_mesh(model);
      return {result};
    });
  }

  measure() {
    const library = this.#library;
    return this.#call((wasm, model) => {
      const out = library.allocate(10 * 8), status = wasm.measure(model, out);
      const [volume, area, ...rest] = new Float64Array(wasm.memory.buffer, out, 10);
      return {status, result: {volume, area, lower: rest.slice(0, 3), upper: rest.slice(3, 6), components: rest[6], euler: rest[7]}};
    });
  }

  snapshot(kind = 'all') {
    const library = this.#library, number = numberOf(kind, KINDS, 'snapshot');
    return this.#call((wasm, model) => {
      const size = library.allocate(4);
      let status = wasm.snapshot(model, number, 0, 0, size);
      if (status) return {status};
      const bytes = library.integers(size, 1)[0], out = library.allocate(bytes);
      status = wasm.snapshot(model, number, out, bytes, size);
      return {status, result: new Uint8Array(wasm.memory.buffer, out, bytes).slice()};
    });
  }

  restore(snapshot) {
    this.#call((wasm, model) => ({status: wasm.restore(model, this.#library.put(snapshot, Uint8Array), snapshot.length)}));
  }

  get count() { return this.#call((wasm, model) => ({result: wasm.count(model)})); }
  get time() { return this.#call((wasm, model) => ({result: wasm.time(model)})); }
  set time(value) {
    checkNumber(value, 'time');
    this.#call((wasm, model) => (wasm.set_time(model, value), {}));
  }
  stateHash() { return this.#call((wasm, model) => ({result: this.#library.text(wasm.state_hash(model))})); }

  destroy() {
    if (!this.#address) return;
    this.#call((wasm, model) => (wasm.destroy(model), {}));
    this.#address = 0;
  }
}

/** Returns the bytes of springls.wasm beside this module. */
async function read() {
  const url = new URL('./springls.wasm', import.meta.url);
  if (url.protocol === 'file:') {
    const files = await import(/* webpackIgnore: true */ /* @vite-ignore */ 'node:fs/promises');
    return files.readFile(url);
  }
  const response = await fetch(url);
  if (!response.ok) throw new SpringlsError('INVALID_ARGUMENT', `load: ${url} has status ${response.status}`);
  return response.arrayBuffer();
}

export async function load(source) {
  const library = new Library(), made = await WebAssembly.instantiate(await source ?? await read(), library.imports());
  library.wasm = (made.instance ?? made).exports;
  library.wasm._initialize?.();
  return Object.freeze({version: library.text(library.wasm.version()), create: options => new Model(library, options)});
}
