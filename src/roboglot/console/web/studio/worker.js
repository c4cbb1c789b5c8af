// The studio's service worker: keeps a copy of the studio's files, and serves it while the server is away.
const CACHE = "studio", FILES = "/studio/files.json", PATIENCE = 4000; // ms until a copy is served instead of a slow answer
const worker = /** @type {any} */ (self);

worker.addEventListener("install", (/** @type {any} */ event) => { event.waitUntil(fill().then(() => worker.skipWaiting())); });
worker.addEventListener("activate", (/** @type {any} */ event) => { event.waitUntil(worker.clients.claim()); });

async function fill() {
  const [cache, list] = await Promise.all([caches.open(CACHE), fetch(FILES)]);
  await cache.addAll(await list.json());
}

worker.addEventListener("fetch", (/** @type {any} */ event) => {
  const { request } = event, { origin, pathname } = new URL(request.url);
  if (request.method !== "GET" || origin !== location.origin) return;
  if (pathname.startsWith("/api/") && pathname !== "/api/blocks" && pathname !== "/api/lessons") return; // news
  event.respondWith(answer(request, pathname === "/studio" ? "/studio/" : pathname));
});

/** The server's answer; the copy if there is none, or none soon. @param {Request} request @param {string} path */
async function answer(request, path) {
  const cache = await caches.open(CACHE), copy = await cache.match(path, { ignoreVary: true });
  const fresh = fetch(request).then((reply) => {
    if (copy && reply.ok && !reply.redirected && reply.headers.get("etag") !== copy.headers.get("etag")) cache.put(path, reply.clone());
    return reply;
  });
  if (!copy) return fresh;
  const late = new Promise((resolve) => { setTimeout(resolve, PATIENCE, copy); });
  return Promise.race([fresh.catch(() => copy), late]);
}
