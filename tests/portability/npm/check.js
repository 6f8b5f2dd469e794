// check.js - tries all that the package has, in node or a browser. `check` returns lines, "ok" or "FAIL" and what was tried.
import {load, SpringlsError} from 'springls';

const ball = (center, radius) => (points, out) => {
  for (let i = 0; i < out.length; ++i) {
    const [dx, dy, dz] = center.map((c, k) => points[3 * i + k] - c);
    out[i] = Math.sqrt(dx * dx + dy * dy + dz * dz) - radius;
  }
};

const drift = (points, time, out) => {
  for (let i = 0; i < out.length; i += 3) {
    out[i] = 0.5;
    out[i + 1] = points[i] * 0.0625;
    out[i + 2] = 0;
  }
};

/** Returns whether each edge lies between exactly two triangles, that run along it in opposite directions. */
function closed(triangles) {
  const edges = new Set();
  for (let i = 0; i < triangles.length; ++i) {
    const next = i % 3 == 2 ? i - 2 : i + 1, edge = `${triangles[i]} ${triangles[next]}`;
    if (edges.has(edge)) return false;
    edges.add(edge);
  }
  return [...edges].every(edge => edges.has(edge.split(' ').reverse().join(' ')));
}

/** Loads a library in whose memory nothing of 1024 bytes has room. */
async function loadFull(source) {
  const {instantiate} = WebAssembly;
  let made;
  WebAssembly.instantiate = async (...given) => made = await instantiate.apply(WebAssembly, given);
  const springls = await load(source).finally(() => { WebAssembly.instantiate = instantiate; });
  const {allocate} = (made.instance ?? made).exports;
  for (let bytes = 2 ** 30; bytes >= 1024; bytes /= 2) while (allocate(bytes));
  return springls;
}

function thrown(work) {
  try {
    work();
  } catch (error) {
    return error;
  }
  return undefined;
}

export async function check(native, source) {
  const lines = [], test = (good, what) => lines.push(`${good ? 'ok  ' : 'FAIL'} ${what}`);
  const refused = (status, sentence, work) => {
    const error = thrown(work);
    test(error instanceof SpringlsError && error.status == status && sentence.test(error.message), `refused: ${error}`);
  };
  const springls = await load(source), grid = {size: [32, 32, 32], spacing: [0.25, 0.25, 0.25]};
  const model = springls.create(grid);
  test(/^\d+\.\d+\.\d+$/.test(springls.version), `version ${springls.version}`);

  model.setImplicit(ball([3, 4, 4], 2));
  test(Math.abs(model.measure().volume / (4 / 3 * Math.PI * 8) - 1) < 0.01, 'a ball has its volume');
  for (let i = 0; i < 3; ++i) model.step({dt: 1, velocity: drift});
  test(model.time == 3, 'time passes');
  const frame = model.snapshot('frame'), moved = model.stateHash();
  const before = model.snapshot();
  model.combine('difference', ball([6.5, 5, 4], 1));
  test(model.stateHash() == native, `hash ${model.stateHash()}, a native program has ${native}`);

  const mesh = model.mesh();
  test(mesh.triangles.length > 3000 && closed(mesh.triangles), 'the mesh is closed');
  test(mesh.positions.length == mesh.normals.length && mesh.positions.length == mesh.correspondences.length
       && mesh.positions.length == 3 * mesh.springls.length, 'all of a mesh is there');
  test(Math.min(...mesh.positions) >= 0 && Math.max(...mesh.positions) <= 8, 'world units');
  const measures = model.measure();
  test(measures.components == 1 && measures.euler == 2 && measures.lower[0] > 0 && measures.upper[0] < 8, 'a ball with a bite');

  model.restore(before);
  test(model.stateHash() == moved, 'a snapshot is restored');
  model.step({dt: 1, pressure: (points, normals, time, out) => out.fill(0.1), curvature: 0.01});
  model.restore(frame);
  test(model.stateHash() == moved, 'a frame is restored');
  refused('BAD_SNAPSHOT', /restore/, () => model.restore(before.slice(0, 100)));

  const other = springls.create({...grid, params: {keep_edges: 0, volume_lock: true}});
  other.setMesh(mesh.positions, mesh.triangles);
  test(Math.abs(other.measure().volume / measures.volume - 1) < 0.01, 'a mesh is set');
  model.combine('union', other);
  model.settle(5);
  model.time = 7;
  test(model.count > 1000 && model.time == 7, 'solids are united');
  const phi = new Float32Array(32 ** 3).map((_, i) => Math.hypot(i % 32 - 16, (i >> 5) % 32 - 16, (i >> 10) - 16) - 8);
  other.setLevelSet(phi);
  test(Math.abs(other.measure().volume / (4 / 3 * Math.PI * 8) - 1) < 0.01, 'a level set is set');

  refused('INVALID_ARGUMENT', /size/, () => springls.create({size: 2}));
  refused('INVALID_ARGUMENT', /size/, () => springls.create({size: [32, 32]}));
  for (const n of [2 ** 32 + 32, 32.5, NaN, Infinity]) {
    refused('INVALID_ARGUMENT', /size: whole/, () => springls.create({size: n}));
    refused('INVALID_ARGUMENT', /size: whole/, () => springls.create({size: [32, n, 32]}));
    refused('INVALID_ARGUMENT', new RegExp(`settle: .* ${n}$`), () => model.settle(n));
  }
  for (const value of [2 ** 32 + 1, 0.5, NaN]) {
    refused('INVALID_ARGUMENT', new RegExp(`keep_edges .* not ${value}$`), () => springls.create({...grid, params: {keep_edges: value}}));
  }
  refused('INVALID_ARGUMENT', /create: there is no option spacings/, () => springls.create({...grid, spacings: 1}));
  refused('INVALID_ARGUMENT', /step: there is no option velocities/, () => model.step({velocities: drift}));
  refused('INVALID_ARGUMENT', /options/, () => model.step(1));
  refused('INVALID_ARGUMENT', /velocity is no function/, () => model.step({dt: 1, velocity: [1, 0, 0]}));
  refused('INVALID_ARGUMENT', /distance is no function/, () => model.setImplicit(1));
  refused('INVALID_ARGUMENT', /dt is no number/, () => model.step({dt: '1'}));
  refused('INVALID_ARGUMENT', /time .* NaN/, () => { model.time = NaN; });
  refused('INVALID_ARGUMENT', /velocity: .* async/, () => model.step({dt: 1, velocity: async (points, time, out) => out.fill(0)}));
  refused('INVALID_ARGUMENT', /velocity: .* async/, () => model.step({dt: 1, velocity: async () => { throw new Error('late'); }}));
  test(model.time == 7, 'what is refused leaves the model');
  const full = await loadFull(source);
  refused('OUT_OF_MEMORY', /create: out of memory/, () => full.create(grid));
  refused('INVALID_ARGUMENT', /no keep_edge$/, () => springls.create({...grid, params: {keep_edge: 1}}));
  refused('INVALID_ARGUMENT', /min_angle/, () => springls.create({...grid, params: {min_angle: 90}}));
  refused('BAD_MESH', /position 1 of 1/, () => other.setMesh([0, 0, 0], [0, 1, 2]));
  refused('INVALID_ARGUMENT', /whole/, () => other.setMesh([0, 0, 0], [0, 0.5, 2]));
  refused('INVALID_ARGUMENT', /32768 values/, () => other.setLevelSet(phi.slice(1)));
  refused('EMPTY_MODEL', /./, () => other.setImplicit((points, out) => out.fill(1)));
  refused('NON_FINITE', /./, () => model.step({dt: 1, velocity: (points, time, out) => out.fill(NaN)}));
  refused('INVALID_ARGUMENT', /'plus'/, () => model.combine('plus', other));
  refused('INVALID_ARGUMENT', /callback/, () => other.setImplicit(() => model.measure()));
  const mistake = new TypeError('a mistake of the caller');
  test(thrown(() => model.step({dt: 1, velocity: () => { throw mistake; }})) === mistake, 'what a callback throws is thrown');
  test(model.count > 1000, 'the model is there after it');
  for (let i = 0; i < 40; ++i) springls.create({size: 64}).destroy();
  model.destroy();
  model.destroy();
  refused('INVALID_ARGUMENT', /destroyed/, () => model.measure());
  refused('INVALID_ARGUMENT', /destroyed/, () => other.combine('union', model));
  return lines;
}
