// Builds editor.js and LICENSES.txt from editor.mjs and the packages of package-lock.json.
import { build } from "esbuild";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";

const { metafile } = await build({
  entryPoints: ["editor.mjs"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "SceneEditor",
  target: "es2022",
  legalComments: "none",
  outfile: "editor.js",
  metafile: true,
});

// The licence of every package that is part of the bundle.
const names = Object.keys(metafile.inputs).map((path) => path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)/)).filter(Boolean);
const texts = [...new Set(names.map((found) => found[1]))].sort().map((name) => {
  const folder = `node_modules/${name}`;
  const about = JSON.parse(readFileSync(`${folder}/package.json`, "utf8"));
  const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
  return `${name} ${about.version} (${about.license})\n\n${readFileSync(`${folder}/${file}`, "utf8").trim()}\n`;
});
writeFileSync("LICENSES.txt", texts.join("\n----\n\n"));
