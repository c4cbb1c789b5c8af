"use strict";
// Lists what /openapi.json describes, and sends what people fill in.
const WORDS = {
  en: { filter: "Filter", send: "Send", other: "中文", file: "file", download: "download", partial: "In part: " },
  zh: { filter: "筛选", send: "发送", other: "English", file: "文件", download: "下载", partial: "部分实现:" },
};
let language = navigator.language.startsWith("zh") ? "zh" : "en";
let api;

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function resolve(schema) {
  const name = schema.$ref && schema.$ref.split("/").pop();
  return name ? api.components.schemas[name] : schema;
}

function example(schema, depth = 0) {
  schema = resolve(schema);
  const choices = schema.anyOf || schema.oneOf;
  if (choices) return example(choices[0], depth);
  if (schema.examples) return schema.examples[0];
  if (schema.enum) return schema.enum[0];
  if ("default" in schema && typeof schema.default !== "object") return schema.default;
  if (schema.type === "array") return depth > 4 ? [] : [example(schema.items || {}, depth + 1)];
  if (schema.type === "object" && schema.properties && depth <= 4) {
    return Object.fromEntries(Object.entries(schema.properties).map(([k, v]) => [k, example(v, depth + 1)]));
  }
  return { object: {}, string: "", integer: 0, number: 0, boolean: true }[schema.type] ?? null;
}

function form(method, path, operation) {
  const words = WORDS[language];
  const parameters = (operation.parameters || []).map((p) => ({ ...p, input: element("input", { required: p.required }) }));
  const content = operation.requestBody && operation.requestBody.content;
  const binary = content && "application/octet-stream" in content;
  const body = content && (binary ? element("input", { type: "file" }) : element("textarea", { spellcheck: false }));
  if (content && !binary) body.value = JSON.stringify(example(content["application/json"].schema), null, 2);
  const answer = element("pre", { hidden: true });
  const made = element("form", {}, ...parameters.map((p) => element("label", {}, element("code", { textContent: p.name }), p.input)));
  if (operation["x-partial"]) made.prepend(element("p", { className: "partial", textContent: words.partial + operation["x-partial"] }));
  if (body) made.append(body);
  made.append(element("button", { textContent: words.send }), answer);
  made.addEventListener("submit", async (event) => {
    event.preventDefault();
    let url = path;
    const query = new URLSearchParams();
    for (const p of parameters) {
      if (p.in === "path") url = url.replace(`{${p.name}}`, encodeURIComponent(p.input.value));
      else if (p.input.value) query.set(p.name, p.input.value);
    }
    const options = { method };
    if (binary) options.body = body.files[0] || "";
    else if (body && body.value.trim()) Object.assign(options, { body: body.value, headers: { "content-type": "application/json" } });
    answer.hidden = false;
    try {
      await show(answer, await fetch(query.size ? `${url}?${query}` : url, options));
    } catch (error) {
      answer.textContent = String(error);
    }
  });
  return made;
}

async function show(answer, reply) {
  answer.textContent = `${reply.status} ${reply.statusText}\n`;
  if ((reply.headers.get("content-type") || "").includes("octet-stream")) {
    const blob = await reply.blob();
    answer.append(element("a", { href: URL.createObjectURL(blob), download: "map", textContent: `${WORDS[language].download} (${blob.size})` }));
    return;
  }
  const text = await reply.text();
  try {
    answer.append(JSON.stringify(JSON.parse(text), null, 2));
  } catch {
    answer.append(text);
  }
}

function draw() {
  const words = WORDS[language];
  const wanted = document.getElementById("filter").value.toLowerCase();
  document.documentElement.lang = language;
  document.getElementById("filter").placeholder = words.filter;
  document.getElementById("language").textContent = words.other;
  document.getElementById("version").textContent = api.info.version;
  const chapters = new Map();
  for (const [path, methods] of Object.entries(api.paths)) {
    for (const [method, operation] of Object.entries(methods)) {
      const summary = (language === "zh" && operation["x-summary-zh"]) || operation.summary;
      if (!`${method} ${path} ${summary} ${operation.operationId}`.toLowerCase().includes(wanted)) continue;
      const name = method.toUpperCase();
      const head = element("summary", {}, element("b", { className: name, textContent: name }), element("code", { textContent: path }), element("span", { textContent: summary }));
      const entry = element("details", {}, head);
      entry.addEventListener("toggle", () => entry.children.length === 1 && entry.append(form(name, path, operation)));
      const tag = operation.tags[0];
      if (!chapters.has(tag)) chapters.set(tag, element("section", {}, element("h2", { textContent: tag })));
      chapters.get(tag).append(entry);
    }
  }
  document.getElementById("operations").replaceChildren(...chapters.values());
}

document.getElementById("filter").addEventListener("input", draw);
document.getElementById("language").addEventListener("click", () => {
  language = language === "en" ? "zh" : "en";
  draw();
});
fetch("/openapi.json").then((reply) => reply.json()).then((described) => {
  api = described;
  draw();
});
