import { useState } from 'preact/hooks';
import { uniqueId } from '../dom';

/** Returns an id that is unique on the page: those of Preact's `useId` are unique in what is rendered as one. */
export function useId(): string {
  const [id] = useState(() => uniqueId('part'));
  return id;
}
