/** Numbers that are copied into the library. */
export type Numbers = ArrayLike<number>;

/** A point, a vector or a size: x first. */
export type Vector = ArrayLike<number>;

/** Writes the velocity at each point, 3 numbers each, in world units a unit of time. The arrays belong to the library, and last as long
 * as the call, in which the library may not be called. What it throws is thrown by the call that it serves. */
export type Velocity = (points: Float32Array, time: number, out: Float32Array) => void;

/** Writes the speed along the outward normal of each point, 1 number each. */
export type Pressure = (points: Float32Array, normals: Float32Array, time: number, out: Float32Array) => void;

/** Writes the signed distance of each point, negative inside, or a lower bound of it, 1 number each. */
export type Distance = (points: Float32Array, out: Float32Array) => void;

/** A call that has failed; `message` is the library's sentence. */
export class SpringlsError extends Error {
  readonly status: 'INVALID_ARGUMENT' | 'OUT_OF_MEMORY' | 'BAD_MESH' | 'NON_FINITE' | 'EMPTY_MODEL' | 'CANCELLED' | 'DEVICE_FAILED' | 'BAD_SNAPSHOT';
}

export interface ModelOptions {
  /** Voxels along each axis, 4 to 4096; one number: a cube. */
  size: number | Vector;
  /** World units a voxel along each axis; 1. */
  spacing?: Vector;
  /** World position of voxel (0,0,0); 0. */
  origin?: Vector;
  /** Row-major, its columns are the unit vectors of the grid's axes; the identity. */
  direction?: Numbers;
  /** The grid is a window that moves with the model; then its sizes are multiples of 8. */
  follow?: boolean;
  /** Members of springls_params that differ from the default set, or from the paper's. */
  params?: Record<string, number | boolean>;
  /** Begins with the paper's parameters. */
  paper?: boolean;
}

export interface StepOptions {
  /** Time to advance; 0: as long as the fastest particle takes for maxDisplacement. */
  dt?: number;
  velocity?: Velocity;
  pressure?: Pressure;
  /** Motion by this times the sum of both principal curvatures, squared world units a unit of time: positive smooths. */
  curvature?: number;
  /**
   * Voxels: dt is divided into sub-steps in which no particle moves further. 0: what suits the parameters, 2 with the default set;
   * negative: never divided.
   */
  maxDisplacement?: number;
  mode?: 'fluid' | 'elastic' | 'advect_only';
}

/** A watertight mesh, copied: world coordinates, 3 numbers a vertex, 3 indices a triangle. */
export interface Mesh {
  positions: Float32Array;
  normals: Float32Array;
  /** The place of each vertex on the original surface. */
  correspondences: Float32Array;
  /** The index of the springl nearest to each vertex; -1: none is near. */
  springls: Int32Array;
  triangles: Uint32Array;
}

export interface Measures {
  volume: number;
  area: number;
  lower: number[];
  upper: number[];
  components: number;
  euler: number;
}

/** A surface. Every method throws a SpringlsError where the library reports a failure. */
export interface Model {
  /** Springls that there are. */
  readonly count: number;
  time: number;
  setParams(members: Record<string, number | boolean>): void;
  /** Replaces the model by a triangle mesh, counter-clockwise seen from outside. */
  setMesh(positions: Numbers, triangles: Numbers): void;
  /** Replaces the model by the zero level of a dense volume, one value a voxel, x fastest, negative inside. */
  setLevelSet(phi: Numbers): void;
  /** Replaces the model by the zero level of a function. */
  setImplicit(distance: Distance): void;
  step(options?: StepOptions): void;
  /** Runs steps in which no time passes until the model is at rest, at most `steps`. */
  settle(steps?: number): void;
  /** Combines the solid with another one of the same grid, or with one that a function describes. */
  combine(operation: 'union' | 'intersection' | 'difference', other: Model | Distance): void;
  mesh(): Mesh;
  measure(): Measures;
  /** Copies the state; 'frame' is without the original surface, for undo in this model. */
  snapshot(kind?: 'all' | 'frame'): Uint8Array;
  restore(snapshot: Uint8Array): void;
  /** 16 digits: equal states have equal hashes, here and in programs of any machine. */
  stateHash(): string;
  /** Frees the memory; the model cannot be used after it. */
  destroy(): void;
}

export interface Springls {
  /** "major.minor.patch" */
  readonly version: string;
  create(options: ModelOptions): Model;
}

/** Compiles the library. source: the bytes of springls.wasm, or a module of them, where they do not lie beside index.js. */
export function load(source?: BufferSource | WebAssembly.Module | Promise<BufferSource | WebAssembly.Module>): Promise<Springls>;
