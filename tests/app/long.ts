/** Options of a test that is too long for every change, and runs in `npm run test:all`. It must not need those before. */
export const LONG = { tags: ['long'] };

/**
 * Options of a test of what the labs have in common: for every change it runs in one lab, and in the others in
 * `npm run test:all`.
 */
export const inOneLab = (lab: string) => (lab === 'extract' ? {} : LONG);
