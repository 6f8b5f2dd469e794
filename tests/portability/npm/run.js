// run.js node|COMMAND: runs check.js here, or in Chromium, without a window, in a page that this serves from the folder it is in. Prints
// its lines; the status is 0 when none failed.
import {spawn} from 'node:child_process';
import {readFile} from 'node:fs/promises';
import {createServer} from 'node:http';

const native = (await readFile('native.txt', 'utf8')).trim();
const TYPES = {js: 'text/javascript', wasm: 'application/wasm'};
const PAGE = `<!doctype html><script type="importmap">{"imports": {"springls": "/node_modules/springls/index.js"}}</script>
<script type="module">
let lines;
try {
  const {check} = await import('/check.js');
  lines = await check('${native}');
} catch (error) {
  lines = ['FAIL ' + error];
}
fetch('/lines', {method: 'POST', body: JSON.stringify(lines)});
</script>`;

/** Serves the page; the promise is of the lines that it sends. */
function serve(then) {
  return new Promise(done => {
    const server = createServer(async (request, response) => {
      if (request.method == 'POST') {
        let body = '';
        for await (const part of request) body += part;
        response.end();
        done(JSON.parse(body));
      } else if (request.url == '/') {
        response.setHeader('Content-Type', 'text/html').end(PAGE);
      } else {
        const file = await readFile('.' + request.url).catch(() => null);
        response.setHeader('Content-Type', TYPES[request.url.split('.').pop()] ?? 'text/plain');
        response.writeHead(file ? 200 : 404).end(file);
      }
    }).listen(0, '127.0.0.1', () => then(server.address().port));
    setTimeout(() => done(['FAIL nothing came from the page']), 300000).unref();
  });
}

async function inBrowser() {
  let browser;
  const lines = await serve(port => {
    browser = spawn(process.argv[2], ['--headless', '--no-sandbox', `--user-data-dir=${process.cwd()}/profile`, '--remote-debugging-port=0',
                                      `http://127.0.0.1:${port}/`], {stdio: 'ignore'});
  });
  browser.kill();
  return lines;
}

let lines;
if (process.argv[2] == 'node') {
  const {check} = await import('./check.js');
  lines = await check(native);
} else {
  lines = await inBrowser();
}
console.log(lines.join('\n'));
process.exit(lines.length > 20 && lines.every(line => line.startsWith('ok')) ? 0 : 1);
