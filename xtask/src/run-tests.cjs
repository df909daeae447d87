// Runs the wasm tests of a module whose glue is for Node. The options are those of `wasm-bindgen-test-runner`:
// `node run-tests.cjs <glue> [--include-ignored] [--nocapture] [--exact] [--list] [--skip <name>]… [<name>…]`.
// Without `--exact`, names are parts of those of tests.
const { parseArgs } = require('node:util');

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    'include-ignored': { type: 'boolean', default: false },
    nocapture: { type: 'boolean', default: false },
    exact: { type: 'boolean', default: false },
    list: { type: 'boolean', default: false },
    skip: { type: 'string', multiple: true, default: [] },
  },
});
const [glue, ...wanted] = positionals;
const tests = require(glue);

/** Exports that are tests, by name: `__wbgt_<flags>_<crate>::<name>`. */
const all = Object.keys(tests.__wasm)
  .filter((symbol) => symbol.startsWith('__wbgt_') && symbol.includes('::'))
  .map((symbol) => ({ symbol, name: symbol.slice(symbol.indexOf('::') + 2) }));

const isOneOf = (name, names) => names.some((one) => (values.exact ? name === one : name.includes(one)));
const selected = all.filter(
  ({ name }) => (wanted.length === 0 || isOneOf(name, wanted)) && !isOneOf(name, values.skip),
);

/** Lets the tests take in what is written to the console, which is shown with that of a test that fails. */
function capture() {
  global.__wbgtest_og_console_log = console.log;
  global.__wbgtest_og_console_error = console.error;
  for (const method of ['debug', 'log', 'info', 'warn', 'error']) {
    const original = console[method];
    console[method] = (...args) => {
      if (values.nocapture) original(...args);
      tests[`__wbgtest_console_${method}`](args);
    };
  }
}

async function run() {
  global.__wbg_test_invoke = (work) => work();
  const context = new tests.WasmBindgenTestContext(false);
  context.include_ignored(values['include-ignored']);
  context.filtered_count(all.length - selected.length);
  capture();
  return context.run(selected.map(({ symbol }) => tests.__wasm[symbol]));
}

if (values.list) {
  for (const { name } of selected) console.log(`${name}: test`);
} else {
  run().then(
    (passed) => process.exit(passed ? 0 : 1),
    (error) => {
      global.__wbgtest_og_console_error(error);
      process.exit(1);
    },
  );
}
