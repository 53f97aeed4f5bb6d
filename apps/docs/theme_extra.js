// SPDX-License-Identifier: BSD-3-Clause
// Debian's theme asks for a file of this name and does not have it. It puts tables in the class that the theme styles.
for (const table of document.querySelectorAll('.rst-content table')) {
  table.classList.add('docutils');
  const frame = document.createElement('div');
  frame.className = 'wy-table-responsive';
  table.replaceWith(frame);
  frame.append(table);
}
