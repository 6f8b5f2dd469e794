// web.js PAGE PICTURES: opens the page of examples/web in headless Chromium, shapes a ball with mouse and touch as a
// person would, runs both examples and compares their hashes with the native ones. Writes pictures. The last line is "N passed, N failed".
'use strict';
const {spawn} = require('child_process'), fs = require('fs'), path = require('path');
const [page, pictures] = process.argv.slice(2).map(p => path.resolve(p));

const browser = spawn(process.env.CHROMIUM || 'chromium-headless-shell', ['--remote-debugging-pipe', '--no-sandbox',
  '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--window-size=900,600', 'about:blank'],
  {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
const [, , , toBrowser, fromBrowser] = browser.stdio, answers = new Map();
let rest = '', count = 0, session, passed = 0, failed = 0;

fromBrowser.on('data', data => {
  const messages = (rest + data).split('\0');
  rest = messages.pop();
  for (const m of messages.map(JSON.parse)) {
    if (m.id) {
      answers.get(m.id)(m);
    } else if (m.method == 'Runtime.exceptionThrown') {
      check('no exception: ' + JSON.stringify(m.params.exceptionDetails), false);
    }
  }
});

function send(method, params = {}) {
  const id = ++count;
  toBrowser.write(JSON.stringify({id, method, params, sessionId: session}) + '\0');
  return new Promise((done, fail) => answers.set(id, m => m.error ? fail(new Error(method + ': ' + m.error.message)) : done(m.result)));
}
const value = async expression => (await send('Runtime.evaluate', {expression, awaitPromise: true})).result.value;
const pause = ms => new Promise(done => setTimeout(done, ms));

function check(what, good) {
  good ? ++passed : ++failed;
  console.log((good ? 'pass ' : 'FAIL ') + what);
}

// Waits until the model is at rest; returns the page's text.
async function settled() {
  for (let i = 0; i < 1200; ++i) {
    await pause(100);
    const text = await value('document.getElementById("text").textContent');
    if (/^state [0-9a-f]{16}/m.test(text) && !await value('waiting')) return text;
  }
  throw new Error('no rest: ' + await value('document.getElementById("text").textContent'));
}
const hash = text => /^state ([0-9a-f]{16})/m.exec(text)[1];
const click = label => value(`[...document.querySelectorAll('button')].find(b => b.textContent == ${JSON.stringify(label)}).click()`);
const mouse = (type, x, y, more) => send('Input.dispatchMouseEvent', {type, x, y, button: 'left', clickCount: 1, ...more});
const touch = (type, points) => send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([x, y], id) => ({x, y, id}))});

async function stroke(from, to, steps, hold = 0) {
  await mouse('mouseMoved', ...from, {button: 'none'});
  await mouse('mousePressed', ...from);
  for (let i = 1; i <= steps; ++i) {
    await mouse('mouseMoved', ...from.map((a, k) => a + (to[k] - a) * i / steps));
  }
  await pause(hold);
  await mouse('mouseReleased', ...to);
  return settled();
}

// Writes a picture. Returns its middle, without buttons and text, as a PNG in base 64.
async function picture(name) {
  fs.writeFileSync(path.join(pictures, name), Buffer.from((await send('Page.captureScreenshot')).data, 'base64'));
  return (await send('Page.captureScreenshot', {clip: {x: 200, y: 150, width: 500, height: 330, scale: 1}})).data;
}

// Drops a file of this text, or of these bytes, on the page; returns the page's text at rest.
async function drop(name, content) {
  await value(`(() => { const data = new DataTransfer(); data.items.add(new File([${content}], ${JSON.stringify(name)}));
    window.dispatchEvent(new DragEvent('drop', {dataTransfer: data, cancelable: true})); })()`);
  await pause(300);
  return settled();
}

// An OBJ of a ring: four corners around each of its sides.
const ring = () => {
  const lines = [], sides = 24;
  for (let i = 0; i < sides; ++i) {
    for (const [r, z] of [[2, 0], [3, 0], [3, 1], [2, 1]]) {
      lines.push(['v', r * Math.cos(i * 2 * Math.PI / sides), r * Math.sin(i * 2 * Math.PI / sides), z].join(' '));
    }
  }
  for (let i = 0; i < sides; ++i) {
    for (let k = 0; k < 4; ++k) {
      const [a, b] = [i, (i + 1) % sides].map(n => 4 * n), [p, q] = [k, (k + 1) % 4];
      lines.push(`f ${a + q + 1}/1 ${a + p + 1}/1 ${b + p + 1}/1 ${b + q + 1}/1`);
    }
  }
  return JSON.stringify(lines.join('\n'));
};

async function run() {
  fs.mkdirSync(pictures, {recursive: true});
  const {targetInfos} = await send('Target.getTargets');
  session = (await send('Target.attachToTarget', {targetId: targetInfos.find(t => t.type == 'page').targetId, flatten: true})).sessionId;
  await send('Runtime.enable');
  await send('Page.enable');
  await send('Emulation.setDeviceMetricsOverride', {width: 900, height: 600, deviceScaleFactor: 1, mobile: false});
  await send('Page.navigate', {url: 'file://' + page});
  const ball = await settled();
  check('a ball', /[1-9]\d{3} springls/.test(ball));
  await picture('ball.png');

  const changes = async (what, before, text) => check(what + ' changes the model', hash(text) != hash(before)) || text;
  const tools = {drag: [[450, 300], [560, 180], 20], push: [[400, 340], [400, 340], 1, 700], inflate: [[500, 380], [500, 380], 1, 500],
    smooth: [[400, 340], [410, 340], 4, 300], cut: [[250, 200], [650, 240], 8]};
  let text = ball;
  for (const [tool, at] of Object.entries(tools)) {
    await click(tool);
    const after = await stroke(...at);
    changes(tool, text, after);
    text = after;
  }
  await click('merge');
  await stroke([450, 420], [470, 470], 6);
  await click('join');
  const merged = await settled();
  changes('merge', text, merged);
  await picture('modelled.png');
  await click('undo');
  check('undo leads back to the same bits', hash(await settled()) == hash(text));
  await click('redo');
  check('redo as well', hash(await settled()) == hash(merged));

  const surface = await picture('surface.png');
  await click('wireframe');
  await settled();
  const wires = await picture('wireframe.png');
  check('the wireframe is another picture of the same bits', hash(await settled()) == hash(merged) && wires != surface
    && await value("views[call.view()] == 'wireframe'"));
  await click('wireframe');
  await settled();
  check('and the surface is drawn again', await picture('surface.png') == surface && surface.length > 1000);

  await click('drag');
  await touch('touchStart', [[440, 330]]);
  for (let i = 1; i <= 10; ++i) await touch('touchMove', [[440 - 8 * i, 330 + 4 * i]]);
  await touch('touchEnd', []);
  text = await settled();
  changes('a finger', merged, text);
  await touch('touchStart', [[400, 300], [500, 300]]);
  for (let i = 1; i <= 10; ++i) await touch('touchMove', [[400 - 10 * i, 300 + 3 * i], [500 + 10 * i, 300 + 3 * i]]);
  await touch('touchEnd', []);
  check('two fingers move the camera alone', hash(await settled()) == hash(text));
  await picture('touched.png');

  const dropped = await drop('Ring.OBJ', ring());
  check('a mesh that is dropped on the page is opened', hash(dropped) != hash(text) && /[1-9]\d{3} springls/.test(dropped));
  await picture('dropped.png');
  const refused = await drop('broken.stl', JSON.stringify('solid nothing'));
  check('a bad file is refused, and the model stays', hash(refused) == hash(dropped) && /broken|no such mesh/.test(refused));
  check('so is one of another kind', /OBJ and binary STL/.test(await drop('notes.txt', '"?"')));

  await click('LeVeque’s flow');
  await pause(800);
  await picture('flow.png');
  check('LeVeque’s flow has the native bits', / = native flow/.test(await settled()));
  await picture('flow_end.png');
  await click('strokes');
  check('the strokes have the native bits', / = native strokes/.test(await settled()));
  await picture('strokes.png');
}

run().catch(error => check(error.stack, false)).then(async () => {
  await Promise.race([send('Browser.close').catch(() => {}), pause(2000)]);
  console.log(`${passed} passed, ${failed} failed`);
  process.exit(failed > 0 ? 1 : 0);
});
