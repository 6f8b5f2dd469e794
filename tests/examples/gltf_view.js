// gltf_view.js FILE.glb PICTURE.png [CLIP]: shows a file by three.js in headless Chromium, at six times of a clip (its name or number;
// none: as it stands). Prints "N % drawn, C colors"; ends with 1 if the file cannot be shown, with 77 if three.js (build/npm) or Chromium
// is missing.
'use strict';
const {spawn, spawnSync} = require('child_process'), fs = require('fs'), http = require('http'), path = require('path');
const [file, picture, clip] = process.argv.slice(2);
const three = path.join(__dirname, '..', '..', 'build', 'npm', 'node_modules', 'three');
const chromium = process.env.CHROMIUM || 'chromium-headless-shell';
if (!fs.existsSync(three) || spawnSync(chromium, ['--version']).error) process.exit(77);

const page = `<!doctype html><body style="margin:0"><script type="importmap">{"imports": {"three": "/three/build/three.module.js",
"three/addons/": "/three/examples/jsm/"}}</script><script type="module">
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
const shots = 6, width = 200, height = 300, clip = ${JSON.stringify(clip === undefined ? null : clip)};
async function show() {
  const renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true}), scene = new THREE.Scene();
  renderer.setSize(shots * width, height);
  renderer.setScissorTest(true);
  document.body.append(renderer.domElement);
  scene.background = new THREE.Color(0xffffff);
  scene.add(new THREE.HemisphereLight(0xffffff, 0x888888, 2.2));
  const light = new THREE.DirectionalLight(0xffffff, 1.6);
  light.position.set(1, 2, 3);
  scene.add(light);
  const gltf = await new GLTFLoader().loadAsync('/file.glb');
  scene.add(gltf.scene);
  const chosen = clip === null ? null : gltf.animations.find(a => a.name == clip) || gltf.animations[+clip];
  if (clip !== null && !chosen) throw new Error('no clip ' + clip);
  const mixer = new THREE.AnimationMixer(gltf.scene), box = new THREE.Box3();
  if (chosen) mixer.clipAction(chosen).play();
  const at = i => { if (chosen) mixer.setTime(chosen.duration * Math.min(i / (shots - 1), 0.9999)); scene.updateMatrixWorld(true); };
  for (let i = 0; i < shots; ++i) {
    at(i);
    scene.traverse(o => {
      if (!o.isMesh || !(o.getWorldScale(new THREE.Vector3()).x > 0)) return;
      if (o.isSkinnedMesh) o.computeBoundingBox();
      box.expandByObject(o, true);
    });
    scene.traverse(o => { o.frustumCulled = false; });
  }
  const size = box.getSize(new THREE.Vector3()), middle = box.getCenter(new THREE.Vector3()), far = 2.2 * Math.max(size.y, size.x, size.z);
  const camera = new THREE.PerspectiveCamera(30, width / height, far / 100, far * 10);
  camera.position.copy(middle).add(new THREE.Vector3(0.35, 0.15, 1).normalize().multiplyScalar(far * 1.2));
  camera.lookAt(middle);
  for (let i = 0; i < shots; ++i) {
    at(i);
    renderer.setViewport(i * width, 0, width, height);
    renderer.setScissor(i * width, 0, width, height);
    renderer.render(scene, camera);
  }
  const gl = renderer.getContext(), rgba = new Uint8Array(4 * shots * width * height), colors = new Set();
  gl.readPixels(0, 0, shots * width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
  let drawn = 0;
  for (let i = 0; i < rgba.length; i += 4) {
    if (rgba[i] + rgba[i + 1] + rgba[i + 2] >= 750) continue;
    ++drawn;
    colors.add((rgba[i] >> 4) << 8 | (rgba[i + 1] >> 4) << 4 | rgba[i + 2] >> 4);
  }
  return Math.round(400 * drawn / rgba.length) + ' % drawn, ' + colors.size + ' colors';
}
window.result = show();
</script>`;
const types = {'.js': 'text/javascript', '.html': 'text/html'};
const server = http.createServer((request, response) => {
  const name = request.url.startsWith('/three/') ? path.join(three, request.url.slice(7)) : request.url == '/file.glb' ? file : null;
  if (request.url == '/') return response.writeHead(200, {'Content-Type': 'text/html'}).end(page);
  if (!name || !fs.existsSync(name)) return response.writeHead(404).end();
  response.writeHead(200, {'Content-Type': types[path.extname(name)] || 'application/octet-stream'}).end(fs.readFileSync(name));
});

const browser = spawn(chromium, ['--remote-debugging-pipe', '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--window-size=1200,300', 'about:blank'], {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
const [, , , toBrowser, fromBrowser] = browser.stdio, answers = new Map();
let rest = '', count = 0, session;
fromBrowser.on('data', data => {
  const messages = (rest + data).split('\0');
  rest = messages.pop();
  for (const m of messages.map(JSON.parse)) if (m.id) answers.get(m.id)(m);
});
function send(method, params = {}) {
  const id = ++count;
  toBrowser.write(JSON.stringify({id, method, params, sessionId: session}) + '\0');
  return new Promise((done, fail) => answers.set(id, m => m.error ? fail(new Error(method + ': ' + m.error.message)) : done(m.result)));
}

async function run() {
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  const {targetId} = await send('Target.createTarget', {url: 'http://127.0.0.1:' + server.address().port + '/'});
  session = (await send('Target.attachToTarget', {targetId, flatten: true})).sessionId;
  for (let i = 0; i < 300; ++i) {
    if ((await send('Runtime.evaluate', {expression: 'typeof window.result'})).result.value == 'object') break;
    await new Promise(done => setTimeout(done, 100));
  }
  const answer = await send('Runtime.evaluate', {expression: 'window.result', awaitPromise: true});
  if (answer.exceptionDetails) throw new Error(answer.result.description || answer.exceptionDetails.text);
  const shot = await send('Page.captureScreenshot', {clip: {x: 0, y: 0, width: 1200, height: 300, scale: 1}});
  fs.writeFileSync(picture, Buffer.from(shot.data, 'base64'));
  console.log(path.basename(file) + ': ' + answer.result.value);
}
run().catch(e => { console.log(path.basename(file) + ': ' + e.message.split('\n')[0]); process.exitCode = 1; })
  .finally(() => { browser.kill(); process.exit(); });
