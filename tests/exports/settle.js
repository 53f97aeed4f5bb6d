// SPDX-License-Identifier: BSD-3-Clause
// Splats are sorted by workers while frames are drawn, in times that nobody knows: draw() is called
// until the canvas shows something and has not changed any more for `still` calls.
export async function settle(canvas, draw, still = 3) {
  const empty = document.createElement("canvas");
  empty.width = canvas.width;
  empty.height = canvas.height;
  const context = empty.getContext("2d");
  context.fillRect(0, 0, empty.width, empty.height);
  const black = empty.toDataURL();
  let last = null, same = 0;
  for (const start = performance.now(); performance.now() - start < 180000;) {
    await draw();
    await new Promise(done => setTimeout(done, 150));
    context.drawImage(canvas, 0, 0);
    const now = empty.toDataURL();
    same = now === last && now !== black ? same + 1 : 0;
    if (same === still) return;
    last = now;
  }
  throw new Error("the picture did not come to rest within three minutes");
}
