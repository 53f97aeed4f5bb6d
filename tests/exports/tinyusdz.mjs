// SPDX-License-Identifier: BSD-3-Clause
// Prints a stage as tinyusdz understands it, as text: tinyusdz.mjs PACKAGE FILE. The package is made for browsers.
import fs from 'node:fs';
import { pathToFileURL } from 'node:url';

process.type = 'renderer';
globalThis.window = globalThis;
const [folder, file] = process.argv.slice(2);
const { default: load } = await import(pathToFileURL(`${folder}/tinyusdz.js`));
const module = await load({ wasmBinary: fs.readFileSync(`${folder}/tinyusdz.wasm`) });
const loader = new module.TinyUSDZLoaderNative();
const bytes = fs.readFileSync(file);
if (!loader.loadFromBinary(bytes, file)) throw new Error(`no stage: ${loader.error()}`);
const layer = new module.TinyUSDZLoaderNative();
if (!layer.loadAsLayerFromBinary(bytes, file)) throw new Error(`no layer: ${layer.error()}`);
console.log(layer.layerToString());
