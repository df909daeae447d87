/** Tables as CSV (RFC 4180), which spreadsheets open. */

export type Cell = string | number | boolean | undefined;

/**
 * Returns rows of cells as CSV. Texts, which may come from a file of anyone, are quoted where needed, and begin with an
 * apostrophe if they would be treated as formulas.
 */
export function csvOf(rows: readonly (readonly Cell[])[]): string {
  return `${rows.map((row) => row.map(cellText).join(',')).join('\n')}\n`;
}

function cellText(cell: Cell): string {
  if (typeof cell !== 'string') return String(cell ?? '');
  // In some countries a cell ends at a semicolon.
  const text = cell.replace(/(^|;\s*)([=+\-−@\t\r])/g, "$1'$2");
  return /[",\r\n\t]|^\s|\s$/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
