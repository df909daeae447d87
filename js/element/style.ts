/** Style sheet of the `<vesicle-lab>` element; the page can override its colours, and style its parts. */
export const STYLE = `
  :host {
    display: grid;
    grid-template-rows: minmax(0, 1fr) auto auto;
    height: 24rem;
    color-scheme: light dark;
    color: light-dark(#1c2024, #edeef0);
    background: light-dark(#f4f1ea, #1b1d20);
    font: 0.9rem / 1.4 system-ui, sans-serif;
  }
  :host([hidden]) { display: none; }
  canvas { width: 100%; height: 100%; min-height: 0; touch-action: none; }
  canvas:focus-visible, button:focus-visible { outline: 2px solid light-dark(#0b6b63, #5fd0c5); outline-offset: -2px; }
  p { margin: auto; padding: 1rem; }
  div { display: flex; flex-wrap: wrap; gap: 0.5rem; align-items: baseline; padding: 0.5rem; }
  ul { max-height: 8rem; overflow: auto; margin: 0; padding: 0.5rem; list-style: none; }
  ul[hidden] { display: none; }
  li { color: light-dark(#7a4a00, #ffcf7a); }
  button { font: inherit; padding: 0.25rem 0.75rem; min-height: 1.75rem; }
  output { flex: 1 1 12rem; }
  output.error { color: light-dark(#a3200d, #ff9d8d); }
  .figures { font-variant-numeric: tabular-nums; color: light-dark(#555b61, #aab0b6); }
`;
