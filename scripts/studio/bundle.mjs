// Packs Blockly and CodeMirror for the studio, which ship no small ES modules, and copies what else they need.
//   cd scripts/studio && npm ci && node bundle.mjs          writes src/roboglot/console/web/studio/vendor
//   node bundle.mjs --check                                 compares instead; fails where anything differs
// The page's Content-Security-Policy allows no style elements, so those the libraries make become style sheets.
import { build, transform } from "esbuild";
import { createHash } from "node:crypto";
import { mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gunzipSync, gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, "../..");
const TARGET = join(root, "src/roboglot/console/web/studio/vendor");
const CONSOLE = join(root, "src/roboglot/console/web/vendor"); // its other files are as npm has them; its sums are kept by hand
const APACHE_NOTICE = "Licensed under the Apache License, Version 2.0: the text is in roboglot's own LICENSE\n";
const AXE = join(root, "tests/browser/vendor");
const MEDIA = ["delete-icon.svg", "foldout-icon.svg", "handclosed.cur", "handdelete.cur", "resize-handle.svg", "sprites.svg"]; // what the bundle names
const BANNER = `const styleSheetElement=()=>{const e=document.createElement("link"),s=new CSSStyleSheet();document.adoptedStyleSheets.push(s);`
  + `Object.defineProperty(e,"textContent",{get:()=>"",set:t=>s.replaceSync(t)});return e};`;

const sheets = {
  name: "style elements become style sheets",
  setup(builder) {
    builder.onLoad({ filter: /\.(js|mjs|cjs)$/ }, async ({ path }) => {
      const text = await readFile(path, "utf-8");
      const found = text.replace(/\b[\w.]+\.createElement\((["'])style\1\)/g, "styleSheetElement()");
      return { contents: found, loader: "js" };
    });
  },
};

async function pack(name) {
  const made = await build({
    entryPoints: [join(here, `${name}.entry.js`)], bundle: true, minify: true, format: "esm", target: "es2022", write: false,
    platform: "browser", conditions: ["import", "browser"], legalComments: "none", charset: "utf8", absWorkingDir: here,
    banner: { js: BANNER }, plugins: [sheets], logLevel: "warning", external: ["jsdom"],
  });
  return made.outputFiles[0].contents;
}

// Stored as it is sent, which is a third as large. What is there stays if it holds the same: releases of zlib differ.
async function packed(folder, name, code) {
  const bundle = Buffer.from(code);
  const there = await readFile(join(folder, `${name}.mjs.gz`)).catch(() => null);
  return there && !Buffer.compare(gunzipSync(there), bundle) ? there : gzipSync(bundle, { level: 9 });
}

// Each text of terms once, below the notices of all packages that are under it.
async function licences(packages) {
  const apache = await readFile(join(root, "LICENSE"), "utf-8"); // shipped once
  const notices = new Map();
  for (const name of packages) {
    const folder = join(here, "node_modules", name);
    const { version } = JSON.parse(await readFile(join(folder, "package.json"), "utf-8"));
    const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
    if (!file) continue;
    const text = await readFile(join(folder, file), "utf-8");
    const mit = /^(?:MIT License\n+)?(Copyright .*\n)\n(Permission is hereby granted[^]*)$/.exec(text);
    const [owner, terms] = mit ? [mit[1], `MIT License\n\n${mit[2]}`] : ["", text === apache ? APACHE_NOTICE : text];
    const owners = notices.get(terms) ?? new Map();
    owners.set(owner, [...(owners.get(owner) ?? []), `${name} ${version}\n`]);
    notices.set(terms, owners);
  }
  const sections = [...notices].map(([terms, owners]) => [...owners].map(([owner, names]) => `${names.join("")}${owner}\n`).join("") + terms);
  return Buffer.from(sections.join("\n\n----------------------------------------\n\n"));
}

async function packagesOf(scopes) {
  const names = [];
  for (const scope of scopes) {
    for (const name of await readdir(join(here, "node_modules", scope))) names.push(`${scope}/${name}`);
  }
  return [...names, "crelt", "style-mod", "w3c-keyname"].sort();
}

async function files() {
  const found = {};
  for (const name of ["blockly", "codemirror"]) found[`${name}.mjs.gz`] = await packed(TARGET, name, await pack(name));
  found["blockly.LICENSE"] = await licences(["blockly"]);
  found["codemirror.LICENSE"] = await licences(await packagesOf(["@codemirror", "@lezer", "@marijn"]));
  for (const name of MEDIA) found[`media/${name}`] = await readFile(join(here, "node_modules/blockly/media", name));
  const sums = Object.keys(found).sort().map((name) => `${createHash("sha256").update(found[name]).digest("hex")}  ${name}\n`);
  found.SHA256SUMS = Buffer.from(sums.join(""));
  return found;
}

async function axe() {
  const found = { "axe.min.js": await readFile(join(here, "node_modules/axe-core/axe.min.js")), "axe.LICENSE": await licences(["axe-core"]) };
  found.SHA256SUMS = Buffer.from(Object.keys(found).sort().map((name) => `${createHash("sha256").update(found[name]).digest("hex")}  ${name}\n`).join(""));
  return found;
}

// The console's plots: their ES module is three times as large as it need be.
async function plots() {
  const { code } = await transform(await readFile(join(here, "node_modules/uplot/dist/uPlot.esm.js"), "utf-8"),
    { minify: true, format: "esm", target: "es2022", charset: "utf8" });
  return { "uplot.mjs.gz": await packed(CONSOLE, "uplot", code) };
}

const checking = process.argv.includes("--check");
const different = [];
for (const [folder, found] of [[TARGET, await files()], [AXE, await axe()], [CONSOLE, await plots()]]) {
  if (!checking && folder !== CONSOLE) await rm(folder, { recursive: true, force: true });
  for (const [name, data] of Object.entries(found)) {
    const path = join(folder, name);
    if (checking) {
      const there = await readFile(path).catch(() => Buffer.alloc(0));
      if (Buffer.compare(there, Buffer.from(data))) different.push(path);
    } else {
      await mkdir(dirname(path), { recursive: true });
      await writeFile(path, data);
    }
  }
}
if (different.length) {
  console.error(`not what bundle.mjs makes: ${different.join(", ")}`);
  process.exit(1);
}
