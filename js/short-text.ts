// Text of files in names, warnings and messages, which people read and pages lay out.

/** Most characters of a name. */
const MOST_NAME = 200;

/** Returns a text, or its first characters and an ellipsis, `most` characters in all; no character is split. */
export function shortened(text: string, most = MOST_NAME): string {
  if (text.length <= most) return text;
  const start = text.slice(0, most - 1);
  return `${start.replace(/[\ud800-\udbff]$/, '')}…`;
}
