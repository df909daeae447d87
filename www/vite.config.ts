import { fileURLToPath } from 'node:url';
import { defineConfig, type Plugin } from 'vite';

/** A live page for each host that there is an adapter for. */
const EMBEDS = ['index', 'three', 'niivue', 'niivue-next', 'vtk', 'itk'];

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** While developing, Vite puts styles inline, which the page's content-security policy forbids; the built page keeps the policy. */
function relaxPolicyWhileDeveloping(): Plugin {
  return {
    name: 'relax-policy-while-developing',
    apply: 'serve',
    transformIndexHtml: (html) => html.replace(/<meta\s+http-equiv="Content-Security-Policy"[^>]*>/, ''),
  };
}

export default defineConfig({
  root: here('.'),
  // Relative addresses: the built page works from any folder of any server.
  base: './',
  resolve: {
    alias: [
      { find: /^vesicle\/(\w+)$/, replacement: `${here('../pkg/adapters')}/$1.js` },
      { find: 'vesicle', replacement: here('../pkg') },
    ],
  },
  plugins: [relaxPolicyWhileDeveloping()],
  worker: { format: 'es' },
  build: {
    outDir: here('../dist'),
    emptyOutDir: true,
    target: 'es2022',
    rolldownOptions: {
      input: ['index', 'bench', ...EMBEDS.map((name) => `embed/${name}`)].map((name) => here(`${name}.html`)),
    },
    // The policy allows no data: script or style; small files stay files.
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
