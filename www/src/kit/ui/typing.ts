/** The value that a field is to show, and that which was last put there. */
interface Shown {
  value: string;
  there: string;
}

const shown = new WeakMap<HTMLInputElement, Shown>();

/**
 * Shows a value in a field of the page, unless the user is typing there, for instance while an earlier change takes effect:
 * then it is shown when the field is left without a change.
 */
export function showIn(field: HTMLInputElement, value: string): void {
  const before = shown.get(field) ?? watched(field);
  before.value = value;
  const isTyping = field === document.activeElement && field.value !== before.there;
  if (!isTyping) field.value = before.there = value;
}

function watched(field: HTMLInputElement): Shown {
  const one = { value: field.value, there: field.value };
  shown.set(field, one);
  // A value that has been entered is no longer being typed.
  const entered = () => {
    one.there = field.value;
  };
  field.addEventListener('change', entered, { capture: true });
  field.addEventListener('blur', () => {
    if (field.value !== one.there) field.value = one.there = one.value;
  });
  return one;
}
