/** Returns JavaScript for a value of plain data; numbers are written so that they are read as the same numbers. */
export function literal(value: unknown): string {
  if (value instanceof Float32Array || value instanceof Float64Array || value instanceof Uint32Array)
    return `new ${value.constructor.name}(${literal([...value])})`;
  if (Array.isArray(value)) return `[${value.map(literal).join(', ')}]`;
  if (typeof value === 'object' && value !== null) {
    const entries = Object.entries(value).map(([name, one]) => `${property(name)}: ${literal(one)}`);
    return entries.length > 0 ? `{ ${entries.join(', ')} }` : '{}';
  }
  if (typeof value === 'string') return /^[\w .-]*$/.test(value) ? `'${value}'` : JSON.stringify(value);
  return Object.is(value, -0) ? '-0' : String(value);
}

const property = (name: string) => (/^[a-z]\w*$/i.test(name) ? name : JSON.stringify(name));
